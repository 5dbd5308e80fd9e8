import numpy as np
import pytest

from racecar.localization.floor.range_table.range_codes import range_codes
from racecar.localization.sensor.beam_table import beam_log_probabilities, beam_probabilities
from racecar.localization.sensor.config import COURSE, BeamModelConfig

CODES = range_codes(32.0)


def by_the_formulas(z: int, d: int) -> float:
    """The course's unnormalized mixture, term by term."""
    gaussian = [np.exp(-((k - d) ** 2) / (2 * 8.0**2)) / np.sqrt(2 * np.pi * 8.0**2) for k in range(201)]
    hit = gaussian[z] / sum(gaussian)
    short = 2 / d * (1 - z / d) if d != 0 and 0 <= z <= d else 0.0
    return 0.74 * hit + 0.07 * short + 0.07 * (z == 200) + 0.12 / 200


@pytest.mark.parametrize("d", [0, 1, 7, 100, 199, 200])
def test_columns_follow_the_course(d: int) -> None:
    column = np.array([by_the_formulas(z, d) for z in range(201)])
    np.testing.assert_allclose(beam_probabilities()[:, d], column / column.sum(), rtol=1e-12)


def test_every_column_sums_to_one() -> None:
    np.testing.assert_allclose(beam_probabilities().sum(axis=0), 1.0, atol=1e-12)
    assert beam_probabilities().shape == (201, 201)
    assert beam_probabilities().min() > 0.0


def test_log_probabilities_are_squashed_and_rounded_to_steps() -> None:
    logs = beam_log_probabilities(np.array([1.02, 50.0]), 10.0, 2.2, COURSE, CODES)
    expected = np.minimum(np.rint(CODES.steps), 200).astype(int)
    np.testing.assert_allclose(logs[0], np.log(beam_probabilities()[20, expected]) / 2.2, rtol=1e-5)
    np.testing.assert_allclose(logs[1], np.log(beam_probabilities()[200, expected]) / 2.2, rtol=1e-5)


def test_a_miss_of_a_short_sighted_sensor_agrees_with_all_that_is_beyond_its_sight() -> None:
    logs = beam_log_probabilities(np.array([np.inf]), 5.0, 1.0, COURSE, CODES)[0]
    assert np.all(logs[100:] == logs[-1])
    assert logs[80] < logs[100] - 0.5


def test_far_ranges_are_distinguished() -> None:
    """A wall at 20 m explains a reading of 20 m better than one at 18 m does."""
    logs = beam_log_probabilities(np.array([20.0]), 30.0, 1.0, COURSE, CODES)[0]
    at_20, at_18 = CODES.encode(np.array([20.0, 18.0]))
    assert logs[at_20] > logs[at_18] + 2.0


def test_computing_logs_leaves_the_table_as_it_was() -> None:
    first = beam_log_probabilities(np.array([1.0, np.inf]), 3.0, 2.2, COURSE, CODES)
    first[:] = 0.0
    assert np.all(beam_log_probabilities(np.array([1.0, np.inf]), 3.0, 2.2, COURSE, CODES) < 0.0)


def test_a_reading_too_short_costs_half_a_nat() -> None:
    """0.2 m is one standard deviation: half a nat, less what something before the wall explains."""
    logs = beam_log_probabilities(np.array([3.0, 2.8]), 30.0, 1.0, BeamModelConfig(), CODES)
    at_3 = int(CODES.encode(np.array(3.0)))
    assert logs[0, at_3] - logs[1, at_3] == pytest.approx(0.48, abs=0.01)


def test_a_sensor_that_sees_farther_may_have_codes_that_reach_farther() -> None:
    far = range_codes(60.0)
    near, beyond = far.encode(np.array([40.0, 55.0]))
    logs = beam_log_probabilities(np.array([40.0]), 70.0, 1.0, COURSE, far)[0]
    assert logs[near] > logs[beyond] + 2.0
