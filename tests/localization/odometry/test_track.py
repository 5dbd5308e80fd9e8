from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.odometry.track import OdometryTrack
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, interpolate
from racecar.maps.sensing.odometry import Odometry

MILLISECOND = 1_000_000
coordinates = st.floats(-0.15, 0.15)
steps = st.tuples(st.integers(10, 60), coordinates, coordinates, coordinates)


def track_of(stamps: list[int], poses: Pose) -> OdometryTrack:
    track = OdometryTrack()
    for stamp, pose in zip(stamps, poses, strict=True):
        track.add(Odometry(stamp, pose, IDENTITY))
    return track


def walk(steps: list[tuple[int, float, float, float]]) -> tuple[list[int], Pose]:
    """Stamps in nanoseconds and poses (N, 3) of a car that took these steps: milliseconds, and increments."""
    stamps, poses = [0], [np.array([1.0, -2.0, 3.0])]
    for milliseconds, *step in steps:
        stamps.append(stamps[-1] + milliseconds * MILLISECOND)
        poses.append(compose(poses[-1], step))
    return stamps, np.array(poses)


def assert_same_poses(told: Pose, expected: Pose) -> None:
    np.testing.assert_allclose(between(expected, told), 0.0, atol=1e-9)


@settings(max_examples=80)
@given(st.lists(steps, min_size=1, max_size=30), st.floats(0.0, 1.0))
def test_between_samples_it_is_interpolated(
    taken: list[tuple[int, float, float, float]], share: float
) -> None:
    stamps, poses = walk(taken)
    track = track_of(stamps, poses)
    assert_same_poses(track.poses_at(stamps), poses)
    wanted = [first + int(share * (last - first)) for first, last in pairwise(stamps)]
    shares = [
        (stamp - first) / (last - first)
        for stamp, (first, last) in zip(wanted, pairwise(stamps), strict=True)
    ]
    assert_same_poses(track.poses_at(wanted), interpolate(poses[:-1], poses[1:], shares))


@settings(max_examples=60)
@given(st.lists(steps, min_size=1, max_size=10), st.floats(0.0, 0.1))
def test_past_the_latest_sample_its_speed_lasts_for_a_little(
    taken: list[tuple[int, float, float, float]], ahead: float
) -> None:
    """Along the car, for a tenth of a second at most."""
    stamps, poses = walk(taken)
    track = track_of(stamps, poses)
    speed = between(poses[-2], poses[-1]) / ((stamps[-1] - stamps[-2]) * 1e-9)
    nanoseconds = int(ahead * 1e9)
    expected = compose(poses[-1], nanoseconds * 1e-9 * speed)
    assert_same_poses(track.poses_at([stamps[-1] + nanoseconds])[0], expected)
    farthest = compose(poses[-1], 0.1 * speed)
    assert_same_poses(track.poses_at([stamps[-1] + 300 * MILLISECOND])[0], farthest)


@pytest.mark.parametrize(("milliseconds", "x"), [(600, 0.1), (20, 5.0)])
def test_no_speed_is_made_of_a_gap_or_a_jump(milliseconds: int, x: float) -> None:
    stamps, poses = walk([(20, 0.1, 0.0, 0.0), (milliseconds, x, 0.0, 0.0)])
    told = track_of(stamps, poses).poses_at([stamps[-1] + 50 * MILLISECOND])[0]
    assert_same_poses(told, poses[-1])


def test_before_the_first_sample_that_one_stands() -> None:
    stamps, poses = walk([(20, 0.1, 0.0, 0.2)])
    assert_same_poses(track_of(stamps, poses).poses_at([-(10**12)])[0], poses[0])


@settings(max_examples=60)
@given(st.lists(steps, min_size=2, max_size=20), st.data())
def test_samples_that_come_late_change_nothing(
    taken: list[tuple[int, float, float, float]], data: st.DataObject
) -> None:
    stamps, poses = walk(taken)
    late = data.draw(st.integers(0, len(stamps) - 1))
    track = track_of(stamps, poses)
    wanted = np.linspace(stamps[0], stamps[-1] + 50 * MILLISECOND, 17).astype(np.int64)
    before = track.poses_at(wanted)
    track.add(Odometry(stamps[late], np.array([99.0, 99.0, 1.0]), IDENTITY))
    track.add(Odometry(stamps[-1] - 1, np.array([99.0, 99.0, 1.0]), IDENTITY))
    np.testing.assert_array_equal(track.poses_at(wanted), before)
    assert track.latest_stamp == stamps[-1]


def test_while_empty_it_tells_nothing() -> None:
    track = OdometryTrack()
    assert track.latest_stamp is None
    with pytest.raises(LookupError):
        track.poses_at([0])


def test_a_day_of_samples_keeps_the_latest_ones() -> None:
    track = OdometryTrack()
    for count in range(30_000):
        track.add(Odometry(count * 20 * MILLISECOND, np.array([0.01 * count, 0.0, 0.0]), IDENTITY))
    latest = track.latest_stamp
    assert latest == 29_999 * 20 * MILLISECOND
    back = np.arange(0, 80_000, 10)
    told = track.poses_at(latest - back * MILLISECOND)
    np.testing.assert_allclose(told[:, 0], 299.99 - 0.01 * back / 20, atol=1e-9)
    assert told[0, 0] > track.poses_at([0])[0, 0] > 0.0


def test_the_heading_goes_the_short_way_round() -> None:
    track = track_of([0, 20 * MILLISECOND], np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.1]]))
    assert abs(track.poses_at([10 * MILLISECOND])[0, 2]) == pytest.approx(np.pi)
