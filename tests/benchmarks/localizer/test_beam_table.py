import numpy as np
import pytest

from benchmarks.localizer.beam_table import beam_probabilities
from racecar.pipelines.experiments.course_filter import sensor_table


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


def test_the_plain_filters_sensor_model_is_that_of_the_courses_filter() -> None:
    np.testing.assert_allclose(beam_probabilities(), sensor_table(), atol=1e-12)
