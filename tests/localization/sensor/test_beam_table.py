import numpy as np
import pytest

from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, CODE_OF_CELLS
from racecar.localization.sensor.beam_table import COURSE, beam_log_probabilities, beam_probabilities


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


def test_log_probabilities_are_squashed_and_rounded_to_pixels() -> None:
    logs = beam_log_probabilities(np.array([1.02, 50.0]), 10.0, 0.05, 2.2, COURSE)
    expected = np.minimum(np.rint(CELLS_OF_CODE), 200).astype(int)
    np.testing.assert_allclose(logs[0], np.log(beam_probabilities()[20, expected]) / 2.2, rtol=1e-5)
    np.testing.assert_allclose(logs[1], np.log(beam_probabilities()[200, expected]) / 2.2, rtol=1e-5)


def test_a_miss_of_a_short_sighted_sensor_agrees_with_all_that_is_beyond_its_sight() -> None:
    logs = beam_log_probabilities(np.array([np.inf]), 5.0, 0.05, 1.0, COURSE)[0]
    assert np.all(logs[100:] == logs[-1])
    assert logs[80] < logs[100] - 0.5


def test_far_ranges_are_told_apart() -> None:
    """A wall at 20 m explains a reading of 20 m better than one at 18 m does."""
    logs = beam_log_probabilities(np.array([20.0]), 30.0, 0.05, 1.0, COURSE)[0]
    at_20, at_18 = (CODE_OF_CELLS[int(metres / 0.05)] for metres in (20.0, 18.0))
    assert logs[at_20] > logs[at_18] + 2.0


def test_computing_logs_leaves_the_table_as_it_was() -> None:
    first = beam_log_probabilities(np.array([1.0, np.inf]), 3.0, 0.05, 2.2, COURSE)
    first[:] = 0.0
    assert np.all(beam_log_probabilities(np.array([1.0, np.inf]), 3.0, 0.05, 2.2, COURSE) < 0.0)
