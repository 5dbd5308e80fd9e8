"""Keyframes are tied where their scans fit, and what they leave open is said."""

import numpy as np
import pytest

from racecar.mapping.keyframes import constraints
from racecar.mapping.keyframes.constraints import constrain, pairs_along_path
from racecar.maps.geometry.se2 import between, compose
from tests.sensors.worlds import CORRIDOR, ROOM, store_of


def test_constraints_are_the_true_poses_and_say_what_is_open() -> None:
    true = np.array([[-2.0 + 0.25 * k, -0.5, 0.0] for k in range(13)])
    for walls, is_bare in ((ROOM, False), (CORRIDOR, True)):
        pairs = np.array([(3, 4), (2, 8), (0, 12)])
        found = constrain(pairs, true, store_of(walls, true))
        assert [(c.from_keyframe, c.to_keyframe) for c in found] == [tuple(pair) for pair in pairs]
        for constraint in found:
            expected = between(true[constraint.from_keyframe], true[constraint.to_keyframe])
            np.testing.assert_allclose(constraint.from_pose_to_pose, expected, atol=0.01)
            along, across = constraint.information[0, 0], constraint.information[1, 1]
            assert (along < 0.02 * across) == is_bare


@pytest.mark.parametrize("missed", [0.0, 0.6])
def test_a_pair_that_does_not_fit_gives_no_constraint(missed: float) -> None:
    true = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]])
    store = store_of(ROOM, true)
    claimed = np.array([true[0], compose(true[1], [0.0, 10 * missed, 3 * missed])])
    found = constrain(np.array([(0, 1)]), claimed, store)
    assert len(found) == (missed == 0.0)


def test_a_keyframe_is_tied_to_some_of_those_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(constraints, "LOOKBACK", (1, 3))
    assert pairs_along_path(range(5)).tolist() == [[0, 1], [1, 2], [2, 3], [0, 3], [3, 4], [1, 4]]
    assert pairs_along_path(range(1)).shape == (0, 2)
