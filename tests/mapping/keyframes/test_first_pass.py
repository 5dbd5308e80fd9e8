"""Only keyframes of different passes are paired, and only with the first pass of each place."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.keyframes import first_pass
from racecar.maps.geometry.se2 import Pose, between

PER_LAP = 120


def laps(count: int, seed: int = 0) -> Pose:
    """(PER_LAP * count, 3) round a circle of 6 m radius, 0.3 m apart, each lap up to a few decimetres beside
    the others."""
    angles = np.arange(PER_LAP * count) * (2.0 * np.pi / PER_LAP)
    radius = 6.0 + 0.3 * np.sin(0.7 * angles + seed)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), angles + np.pi / 2.0])


def pairs_with_first_pass(poses: Pose) -> np.ndarray:
    """(P, 2) where all are kept."""
    return first_pass.pairs_with_first_pass(poses, np.ones(len(poses), dtype=np.bool_))


@settings(max_examples=20)
@given(st.integers(2, 6), st.integers(0, 100))
def test_every_lap_is_tied_to_the_first_one_all_round(count: int, seed: int) -> None:
    pairs = pairs_with_first_pass(laps(count, seed))
    earlier, later = pairs.T
    assert earlier.max() < PER_LAP
    for lap in range(1, count):
        tied = np.unique(later[later // PER_LAP == lap]) % PER_LAP
        assert np.diff(tied).max() <= 3
        assert len(tied) >= PER_LAP // 3 - 1


@settings(max_examples=20)
@given(st.integers(0, 100))
def test_pairs_are_near_face_alike_and_are_few(seed: int) -> None:
    poses = laps(4, seed)
    pairs = pairs_with_first_pass(poses)
    apart = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    distances = np.hypot(apart[:, 0], apart[:, 1])
    assert distances.max() < 2.0
    assert np.median(distances) < 1.0
    assert np.abs(apart[:, 2]).max() < 0.5
    assert len(np.unique(pairs, axis=0)) == len(pairs) <= 2 * len(poses) / 3


def test_who_comes_back_the_other_way_is_not_tied() -> None:
    there = laps(1)[: PER_LAP // 2]
    back = there[::-1] + np.array([0.0, 0.0, np.pi])
    assert len(pairs_with_first_pass(np.concatenate([there, back]))) == 0


def test_neighbours_along_the_path_are_no_other_pass() -> None:
    assert pairs_with_first_pass(laps(1)[: PER_LAP // 2]).shape == (0, 2)
    assert pairs_with_first_pass(np.zeros((1, 3))).shape == (0, 2)
    assert pairs_with_first_pass(np.zeros((39, 3))).shape == (0, 2)


def test_what_was_trimmed_is_not_tied() -> None:
    is_kept = np.arange(4 * PER_LAP) // PER_LAP != 2
    pairs = first_pass.pairs_with_first_pass(laps(4), is_kept)
    assert is_kept[pairs].all()
    assert pairs[:, 0].max() < PER_LAP
    assert np.unique(pairs[:, 1] // PER_LAP).tolist() == [0, 1, 3]
