"""A drive's errors are those that were put in."""

import numpy as np
import pytest

from benchmarks.worlds.drive_errors import DriveErrors, drive_errors
from racecar.maps.geometry.se2 import Pose, compose

STRAIGHT = np.column_stack([np.linspace(0.0, 300.0, 3001), np.zeros(3001), np.zeros(3001)])


def errors_of(found: Pose, true: Pose = STRAIGHT) -> DriveErrors:
    return drive_errors(found, true, np.random.default_rng(0))


def test_the_frame_of_the_map_is_no_error() -> None:
    errors = errors_of(compose(np.array([5.0, -2.0, 1.0]), STRAIGHT))
    assert errors.path_m == pytest.approx(300.0)
    for error in (errors.relation_m, errors.relation_max_m, errors.heading_deg, errors.far_m):
        assert error == pytest.approx(0.0, abs=1e-9)


def test_a_scale_shows_in_relations_and_not_in_headings() -> None:
    errors = errors_of(STRAIGHT * [1.02, 1.0, 1.0])
    assert errors.relation_m == pytest.approx(0.1, rel=0.1)  # pairs are 5 m apart on average
    assert errors.relation_max_m == pytest.approx(0.2, rel=0.02)
    assert errors.heading_deg == pytest.approx(0.0, abs=1e-9)
    assert errors.far_m == pytest.approx(0.02 * errors.path_m)


@pytest.mark.parametrize(("metres", "expected"), [(300.0, 1.0), (50.0, 0.5)])
def test_a_heading_that_drifts_is_told_per_hundred_metres(metres: float, expected: float) -> None:
    true = STRAIGHT[STRAIGHT[:, 0] <= metres]
    bent = true + np.column_stack([0 * true[:, 0], 0 * true[:, 0], np.radians(0.01) * true[:, 0]])
    assert errors_of(bent, true).heading_deg == pytest.approx(expected, rel=0.01)


def test_relations_join_passes_that_are_far_apart_in_time() -> None:
    back = STRAIGHT[::-1].copy()
    true = np.concatenate([STRAIGHT, back])
    found = np.concatenate([STRAIGHT, back + np.array([0.0, 1.0, 0.0])])
    errors = errors_of(found, true)
    assert errors.relation_m == pytest.approx(0.5, abs=0.05)
    assert errors.relation_max_m == pytest.approx(1.0)


def test_a_car_that_never_moved_has_errors_too() -> None:
    true = np.zeros((5, 3))
    assert errors_of(true, true).far_m == 0.0
    found = true.copy()
    found[1:, 0] = 0.1
    assert errors_of(found, true).far_m == pytest.approx(0.1)
