import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.trajectory import Trajectory

STAMPS = np.array([1_000, 2_000, 4_000])
POSES = np.array([[0.0, 0.0, 3.0], [1.0, 2.0, -3.0], [1.0, 0.0, -2.0]])


def test_poses_lie_between_those_about_them() -> None:
    poses = Trajectory(STAMPS, POSES).poses_at(np.array([2_000, 1_500, 3_500]))
    np.testing.assert_allclose(poses[:, :2], [[1.0, 2.0], [0.5, 1.0], [1.0, 0.5]])
    np.testing.assert_allclose(np.cos(poses[:, 2]), np.cos([-3.0, np.pi, -2.25]))


@given(st.integers(-(10**12), 10**12))
def test_they_are_held_beyond_the_ends(stamp: int) -> None:
    pose = Trajectory(STAMPS, POSES).poses_at(np.array([stamp]))[0]
    if stamp <= STAMPS[0]:
        np.testing.assert_allclose(pose, POSES[0])
    if stamp >= STAMPS[-1]:
        np.testing.assert_allclose(pose, POSES[-1])


def test_one_pose_is_everywhere() -> None:
    poses = Trajectory(STAMPS[:1], POSES[:1]).poses_at(np.array([0, 5_000]))
    np.testing.assert_allclose(poses, POSES[[0, 0]])
