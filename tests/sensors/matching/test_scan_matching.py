"""Scan matching finds the pose between two scans of a room, and invents none along a corridor."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import Pose, between, inverse, transform_points
from racecar.sensors.matching.scan_matching import match, one_to_one
from racecar.sensors.matching.scan_matching_kernels import NORMAL_VARIANCE, remove_sliding
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan


def wall(start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    steps = int(np.hypot(end[0] - start[0], end[1] - start[1]) / 0.03)
    return np.linspace(start, end, steps)


ROOM = np.concatenate(
    [
        wall((-3, -2), (4, -2)),
        wall((4, -2), (4, 3)),
        wall((4, 3), (-3, 3)),
        wall((-3, 3), (-3, -2)),
        wall((1, -2), (1, -1)),
    ]
)
CORRIDOR = np.concatenate([wall((-20, -1), (20, -1)), wall((-20, 1), (20, 1))])


def seen_from(world: np.ndarray, pose: Pose) -> np.ndarray:
    """The nearest point of each degree of bearing, as a laser at ``pose`` would see it."""
    points = transform_points(inverse(pose), world)
    bearing = np.floor(np.rad2deg(np.arctan2(points[:, 1], points[:, 0])) * 2).astype(int)
    order = np.argsort(np.hypot(points[:, 0], points[:, 1]))
    _, first = np.unique(bearing[order], return_index=True)
    return points[order[first]]


def pair(world: np.ndarray, first: Pose, second: Pose) -> ScanStore:
    store = ScanStore(2)
    for pose in (first, second):
        store.add(prepare_scan(seen_from(world, pose)))
    return store


@settings(max_examples=40)
@given(
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
    st.floats(-0.25, 0.25),
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
)
def test_finds_the_pose_in_a_room(x: float, y: float, yaw: float, off_x: float, off_yaw: float) -> None:
    first, second = np.array([0.0, 0.3, 0.2]), np.array([x, y, 0.2 + yaw])
    store = pair(ROOM, first, second)
    true = between(first, second)
    result = match(
        (true + np.array([off_x, 0.05, off_yaw]))[None], one_to_one(np.array([[0, 1]])), store, store
    )
    error = between(true, result.poses[0])
    assert np.hypot(error[0], error[1]) < 0.03
    assert abs(error[2]) < 0.01
    assert result.overlap[0] > 0.5


def test_knows_nothing_along_a_bare_corridor() -> None:
    store = pair(CORRIDOR, np.zeros(3), np.array([0.4, 0.1, 0.05]))
    guess = np.array([0.25, 0.05, 0.0])
    result = match(guess[None], one_to_one(np.array([[0, 1]])), store, store)
    along = result.hessians[0][0, 0] / result.hessians[0][1, 1]
    assert along < 0.02
    assert abs(result.poses[0][1] - 0.1) < 0.02
    assert abs(result.poses[0][2] - 0.05) < 0.01


@given(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), st.floats(0.0, 2000.0))
def test_what_noisy_normals_pretend_is_taken_out_of_the_direction_of_least_information(
    numbers: list[float], weight: float
) -> None:
    root = np.reshape(numbers, (3, 3))
    hessian = root @ root.T + 0.1 * np.eye(3)
    gradient = root[0].copy()
    (small, large), axes = np.linalg.eigh(hessian[:2, :2])
    assume(large - small > 0.01)
    shrink = np.sqrt(max(small - NORMAL_VARIANCE * weight, 0.0) / small)
    along = np.array([*axes[:, 0], 0.0])
    projection = np.eye(3) - (1.0 - shrink) * np.outer(along, along)
    expected = projection @ hessian @ projection, projection @ gradient
    remove_sliding(hessian, gradient, weight)
    np.testing.assert_allclose(hessian, expected[0], atol=1e-9)
    np.testing.assert_allclose(gradient, expected[1], atol=1e-9)


def test_scans_without_points_leave_the_guess() -> None:
    store = ScanStore(2)
    for _ in range(2):
        store.add(prepare_scan(np.zeros((0, 2))))
    guess = np.array([[0.1, 0.2, 0.3]])
    result = match(guess, one_to_one(np.array([[0, 1]])), store, store)
    assert np.allclose(result.poses, guess)
    assert result.overlap[0] == 0.0
