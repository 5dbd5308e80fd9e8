"""The noise sweep measures what it says it measures."""

from typing import Any

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.filters import Measured, with_motion_noise
from racecar.pipelines.experiments.noise_sweep import (
    NOISES,
    best,
    measure_step,
    running_mean,
    step_response,
    swept,
)
from racecar.pipelines.experiments.page import COURSE_NAME, OURS_NAME
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings

PERIOD = 0.05


def response(delay: int, unrest: float = 0.0) -> dict[str, Any]:
    """Of an estimate that follows so many scans late; 40 scans before the jump, 200 after it."""
    is_after = np.arange(240) >= 40
    x = (np.arange(240) >= 40 + delay).astype(float)
    x += unrest * np.where(np.arange(240) % 2, 1.0, -1.0)
    return measure_step(np.column_stack([x, x]), is_after)


def measured(seconds: float, spread: float, errors: list[float]) -> Measured:
    """With as many seeds as errors."""
    each = np.ones(len(errors))
    figures = {"seconds_to_converge": seconds * each, "spread": spread * each, "mean_error": np.array(errors)}
    return {"offsets": np.zeros((len(errors), 240, 2)), **figures}


def test_running_mean_is_over_twenty_values() -> None:
    assert running_mean(np.arange(21.0)).tolist() == pytest.approx([9.5, 10.5])


def test_time_to_converge_grows_by_the_delay() -> None:
    at_once = response(0)
    assert at_once["seconds_to_converge"] == pytest.approx(0.75)
    assert response(30)["seconds_to_converge"] - at_once["seconds_to_converge"] == pytest.approx(30 * PERIOD)
    assert response(20)["mean_error"] == pytest.approx(np.sqrt(2.0) * 20 / 200)


def test_an_estimate_that_never_follows_has_not_converged() -> None:
    assert np.isnan(response(1000)["seconds_to_converge"])


def test_spread_is_the_deviation_of_the_estimate_itself() -> None:
    assert response(0, unrest=0.1)["spread"] == pytest.approx(0.1 * np.sqrt(2.0), rel=1e-6)


def test_the_least_noise_is_picked_among_those_that_are_as_good() -> None:
    errors = ([0.3, 0.3], [0.101, 0.099], [0.1, 0.098], [0.2, 0.2], [0.3, 0.3], [0.4, 0.4])
    runs = {noise: measured(1.0, 0.01, error) for noise, error in zip(NOISES, errors, strict=True)}
    assert best(runs) == NOISES[1]


@pytest.mark.parametrize(("course_seconds", "is_explained"), [(0.8, True), (1.2, False)])
def test_the_text_says_why_the_course_is_faster_where_it_is(
    course_seconds: float, is_explained: bool
) -> None:
    def runs(seconds: float, spread: float) -> dict[float, Measured]:
        return {noise: measured(seconds, spread, [noise, noise]) for noise in NOISES}

    result = swept({OURS_NAME: runs(0.9, 0.01), COURSE_NAME: runs(course_seconds, 0.3)})
    text = " ".join(result.text)
    assert "{" not in text
    assert ("the course's filter wins: 0.80 s" in text) == is_explained
    assert ("spreads by 30.0 cm, this library's by 1.0 cm" in text) == is_explained


def test_more_noise_follows_faster_and_is_less_calm() -> None:
    """The course's filter shows the trade-off that the experiment is about."""
    little, much = (step_response(CourseSettings(noise=noise), 0, 0) for noise in (0.02, 0.5))
    assert much["seconds_to_converge"] < little["seconds_to_converge"]
    assert much["spread"] > 3 * little["spread"]


def test_the_same_seed_gives_the_same_trace() -> None:
    variant = with_motion_noise(LocalizationConfig(particles=200, fewest_particles=200), 0.1)
    first, second, other = (step_response(variant, *seeds)["offsets"] for seeds in ((3, 1), (3, 1), (3, 2)))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, other)
