"""Scans speak for the place where they were taken, and against others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.keyframes.scan_evidence import scan_evidence
from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.matching.scan_matching import Pairings, match
from tests.sensors.worlds import CORRIDOR, ROOM, box, path, store_of


def evidence(walls: np.ndarray, poses: Pose, places: Pose) -> np.ndarray:
    """Of places (G, 3) where the last of some scans may have been taken, beside the others."""
    store, fixed = store_of(walls, poses), np.arange(len(poses) - 1)
    groups = len(places)
    pairs = np.tile(np.column_stack([fixed, np.full(len(fixed), len(fixed))]), (groups, 1))
    pairings = Pairings(
        np.arange(groups + 1) * len(fixed),
        pairs,
        np.tile(poses[:-1], (groups, 1)),
        np.zeros((groups * len(fixed), 3)),
    )
    stay = 1e12 * np.eye(3)
    matches = match(places, pairings, store, store, prior_information=stay)
    return scan_evidence(store, fixed, poses[:-1], len(fixed), matches)


@settings(max_examples=20)
@given(st.floats(0.3, 0.8), st.floats(-np.pi, np.pi), st.sampled_from([-0.6, 0.0, 0.6]))
def test_the_true_place_has_the_most(missed: float, towards: float, turned: float) -> None:
    poses = path(np.array((0.2, 0.0, 0.05)), (-2.0, -0.5, 0.1), 5)
    off = np.array([missed * np.cos(towards), missed * np.sin(towards), turned])
    true, wrong = evidence(ROOM, poses, np.stack([poses[-1], compose(poses[-1], off)]))
    assert true > 40.0
    assert wrong < true - 10.0


@pytest.mark.parametrize("ahead", [-0.4, 0.4])
def test_along_a_bare_corridor_all_places_have_as_much(ahead: float) -> None:
    poses = path(np.array((0.4, 0.0, 0.0)), (0.0, 0.0, 0.0), 5)
    true, shifted = evidence(CORRIDOR, poses, np.stack([poses[-1], poses[-1] + [ahead, 0.0, 0.0]]))
    assert abs(true - shifted) < 3.0


def test_scans_that_see_nothing_say_nothing() -> None:
    out_of_reach = box(-99.0, -99.0, 99.0, 99.0)
    poses = path(np.array((0.2, 0.0, 0.0)), (0.0, 0.0, 0.0), 5)
    np.testing.assert_array_equal(evidence(out_of_reach, poses, poses[-2:]), 0.0)
