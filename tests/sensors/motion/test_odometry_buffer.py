"""Odometry at any stamp: between its samples and past the last one; where it repeats a pose, and where it
begins anew."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, interpolate
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.motion.odometry_buffer import Extrapolation, OdometryBuffer
from racecar.sensors.odometry import Odometry, is_jump

MILLISECOND = 1_000_000
GO_ON = Extrapolation(longest=100 * MILLISECOND, speed_over=0, widest_gap=500 * MILLISECOND)
coordinates = st.floats(-0.15, 0.15)
steps = st.tuples(st.integers(10, 60), coordinates, coordinates, coordinates)


def buffer_of(stamps: list[int], poses: Pose) -> OdometryBuffer:
    buffer = OdometryBuffer(extrapolation=GO_ON)
    for stamp, pose in zip(stamps, poses, strict=True):
        buffer.add(Odometry(stamp, pose, IDENTITY))
    return buffer


def walk(steps: list[tuple[int, float, float, float]]) -> tuple[list[int], Pose]:
    """Stamps in nanoseconds and poses (N, 3) of a car that took these steps: milliseconds, and increments."""
    stamps, poses = [0], [np.array([1.0, -2.0, 3.0])]
    for milliseconds, *step in steps:
        stamps.append(stamps[-1] + milliseconds * MILLISECOND)
        poses.append(compose(poses[-1], step))
    return stamps, np.array(poses)


def assert_same_poses(told: Pose, expected: Pose) -> None:
    np.testing.assert_allclose(between(expected, told), 0.0, atol=1e-12)


@settings(max_examples=80)
@given(st.lists(steps, min_size=1, max_size=30), st.floats(0.0, 1.0))
@example([(10, 0.0, 0.0, 0.05), (10, 0.0, 0.0, 0.1419656404655902), (10, 0.0, 0.0, 0.0)], 1.0)
def test_between_samples_it_is_interpolated(
    taken: list[tuple[int, float, float, float]], share: float
) -> None:
    stamps, poses = walk(taken)
    buffer = buffer_of(stamps, poses)
    assert_same_poses(buffer.pose_at(stamps), poses)
    wanted = [first + int(share * (last - first)) for first, last in pairwise(stamps)]
    shares = [
        (stamp - first) / (last - first)
        for stamp, (first, last) in zip(wanted, pairwise(stamps), strict=True)
    ]
    assert_same_poses(buffer.pose_at(wanted), interpolate(poses[:-1], poses[1:], shares))


@settings(max_examples=60)
@given(st.lists(steps, min_size=1, max_size=10), st.floats(0.0, 0.1))
def test_past_the_latest_sample_its_speed_lasts_for_a_little(
    taken: list[tuple[int, float, float, float]], ahead: float
) -> None:
    """Along the car, for a tenth of a second at most."""
    stamps, poses = walk(taken)
    buffer = buffer_of(stamps, poses)
    speed = between(poses[-2], poses[-1]) / ((stamps[-1] - stamps[-2]) * 1e-9)
    nanoseconds = int(ahead * 1e9)
    expected = compose(poses[-1], nanoseconds * 1e-9 * speed)
    assert_same_poses(buffer.pose_at([stamps[-1] + nanoseconds])[0], expected)
    farthest = compose(poses[-1], 0.1 * speed)
    assert_same_poses(buffer.pose_at([stamps[-1] + 300 * MILLISECOND])[0], farthest)


@pytest.mark.parametrize(("milliseconds", "x"), [(600, 0.1), (20, 5.0)])
def test_no_speed_is_made_of_a_gap_or_a_jump(milliseconds: int, x: float) -> None:
    stamps, poses = walk([(20, 0.1, 0.0, 0.0), (milliseconds, x, 0.0, 0.0)])
    told = buffer_of(stamps, poses).pose_at([stamps[-1] + 50 * MILLISECOND])[0]
    assert_same_poses(told, poses[-1])


def test_before_the_first_sample_that_one_stands() -> None:
    stamps, poses = walk([(20, 0.1, 0.0, 0.2)])
    assert_same_poses(buffer_of(stamps, poses).pose_at([-(10**12)])[0], poses[0])


@settings(max_examples=60)
@given(st.lists(steps, min_size=2, max_size=20), st.data())
def test_samples_that_come_late_change_nothing(
    taken: list[tuple[int, float, float, float]], data: st.DataObject
) -> None:
    stamps, poses = walk(taken)
    late = data.draw(st.integers(0, len(stamps) - 1))
    buffer = buffer_of(stamps, poses)
    wanted = np.linspace(stamps[0], stamps[-1] + 50 * MILLISECOND, 17).astype(np.int64)
    before = buffer.pose_at(wanted)
    buffer.add(Odometry(stamps[late], np.array([99.0, 99.0, 1.0]), IDENTITY))
    buffer.add(Odometry(stamps[-1] - 1, np.array([99.0, 99.0, 1.0]), IDENTITY))
    np.testing.assert_array_equal(buffer.pose_at(wanted), before)
    assert buffer.latest_stamp == stamps[-1]


def test_while_empty_it_tells_nothing() -> None:
    buffer = OdometryBuffer(extrapolation=GO_ON)
    assert buffer.latest_stamp is None
    assert not buffer.covers(0)
    with pytest.raises(LookupError):
        buffer.pose_at([0])


def test_a_day_of_samples_keeps_the_latest_ones() -> None:
    buffer = OdometryBuffer(extrapolation=GO_ON)
    for count in range(30_000):
        buffer.add(Odometry(count * 20 * MILLISECOND, np.array([0.01 * count, 0.0, 0.0]), IDENTITY))
    latest = buffer.latest_stamp
    assert latest == 29_999 * 20 * MILLISECOND
    back = np.arange(0, 80_000, 10)
    told = buffer.pose_at(latest - back * MILLISECOND)
    np.testing.assert_allclose(told[:, 0], 299.99 - 0.01 * back / 20, atol=1e-9)
    assert told[0, 0] > buffer.pose_at([0])[0, 0] > 0.0


def test_a_buffer_tells_a_jump_from_samples_that_come_late() -> None:
    buffer, away = OdometryBuffer(), np.array([5.0, 0.0, 0.0])
    assert not buffer.jumps_to(Odometry(0, away, IDENTITY))
    buffer.add(Odometry(20_000_000, IDENTITY, IDENTITY))
    assert buffer.jumps_to(Odometry(40_000_000, away, IDENTITY))
    assert not buffer.jumps_to(Odometry(10_000_000, away, IDENTITY))
    assert not buffer.jumps_to(Odometry(20_000_000, away, IDENTITY))


def steady_drive(lag: int) -> OdometryBuffer:
    """One metre a second, told 50 times a second up to 0.38 s."""
    buffer = OdometryBuffer(lag=lag * MILLISECOND)
    for k in range(20):
        buffer.add(Odometry(k * 20 * MILLISECOND, np.array([0.02 * k, 0.0, 0.0]), IDENTITY))
    return buffer


@pytest.mark.parametrize(
    ("lag", "stamps", "x"),
    [(50, [100, 330, 380, 10_000], [0.15, 0.38, 0.43, 0.43]), (-50, [100, 400, 10_000], [0.05, 0.35, 0.38])],
)
def test_late_samples_tell_of_earlier_times_and_early_ones_of_later(
    lag: int, stamps: list[int], x: list[float]
) -> None:
    """They are carried on for as long as they are late, also by a lag that is learned later."""
    learned = steady_drive(0)
    assert learned.pose_at(430 * MILLISECOND)[0] == pytest.approx(0.38)
    learned.lag = lag * MILLISECOND
    for buffer in (steady_drive(lag), learned):
        assert buffer.pose_at(np.array(stamps) * MILLISECOND)[:, 0] == pytest.approx(x)


@pytest.mark.parametrize(
    ("at", "lag", "is_told"),
    [
        (-50, 0, True),
        (-150, 0, False),
        (200, 0, True),
        (380 + 90, 0, True),
        (380 + 500, 0, False),
        (380 + 500, 90, False),
        (1380 - 90, 0, True),
        (1380 - 190, 100, True),
        (1400 + 500, 0, True),
        (3000, 0, False),
    ],
)
def test_near_its_samples_a_buffer_tells_where_the_car_was(at: int, lag: int, is_told: bool) -> None:
    """Odometry paused for more than a second, and for less."""
    buffer = steady_drive(lag)
    for late in (1390, 2350):
        buffer.add(Odometry(late * MILLISECOND, np.array([1.0, 0.0, 0.0]), IDENTITY))
    assert buffer.covers(at * MILLISECOND) == is_told


def test_stamps_of_any_shape_are_answered_in_that_shape() -> None:
    buffer, stamps = steady_drive(0), np.arange(6).reshape(2, 3) * 50 * MILLISECOND
    assert buffer.pose_at(stamps).shape == (2, 3, 3)
    np.testing.assert_array_equal(buffer.pose_at(stamps)[1, 2], buffer.pose_at(250 * MILLISECOND))


def test_only_the_latest_samples_are_kept() -> None:
    buffer = OdometryBuffer(max_samples=8)
    for count in range(100):
        buffer.add(Odometry(count, np.array([1.0 * count, 0.0, 0.0]), IDENTITY))
        kept = np.arange(max(0, count - 7), count + 1)
        stamps, poses = buffer.samples
        np.testing.assert_array_equal(stamps, kept)
        np.testing.assert_array_equal(poses[:, 0], kept)
        assert len(buffer) == len(kept)


def test_a_pose_that_is_repeated_is_told_from_one_that_comes_again() -> None:
    stamps = [20 * MILLISECOND * k for k in range(8)]
    here, there = np.zeros(3), np.array([1e-9, 0.0, 0.0])
    buffer = buffer_of(stamps, np.array([here, there, there, here, there, there, there, there]))
    assert buffer.repeats_since(stamps[7]) == stamps[4]
    assert buffer.repeats_since(stamps[6]) == stamps[4]
    assert buffer.repeats_since(stamps[5]) is None  # two alike may be one that was sent twice
    assert buffer.repeats_since(stamps[3]) is None
    assert buffer.repeats_since(stamps[3], heading_only=True) == stamps[0]
    assert buffer.repeats_since(stamps[7] + 1_000 * MILLISECOND) is None  # nobody knows by then


SECOND = 1_000_000_000
POSE = np.array([1.0, 2.0, 0.5])
START = 100 * SECOND


def frozen(moved: float) -> FrozenOdometry:
    """From second 5 to second 7."""
    odometry = FrozenOdometry()
    odometry.freeze(START + 5 * SECOND, POSE)
    for second in (6, 7):
        odometry.follow(START + second * SECOND, np.array([0.5 * moved, 0.0, 0.0]))
    return odometry


def test_it_lasts_until_the_pose_changes() -> None:
    odometry = frozen(1.0)
    assert not odometry.thaws_with(Odometry(START + 8 * SECOND, POSE.copy(), IDENTITY))
    assert odometry.is_frozen_at(START + 20 * SECOND)
    assert odometry.thaws_with(Odometry(START + 9 * SECOND, POSE + 1e-9, IDENTITY))
    assert odometry.is_frozen_at(START + 9 * SECOND - 1)  # scans may come after odometry of their sweep's end
    assert not odometry.is_frozen_at(START + 9 * SECOND)
    odometry.follow(START + 10 * SECOND, np.array([1.0, 0.0, 0.0]))  # not part of it any more
    assert "5.0 to 9.0 s" in str(odometry.warning(START))


def test_what_is_not_frozen_may_go_on() -> None:
    odometry = FrozenOdometry()
    odometry.freeze(START, np.array([np.nan, np.nan, 0.5]))
    assert not odometry.thaws_with(Odometry(START + SECOND, np.array([1.0, 2.0, 0.5]), IDENTITY))
    assert odometry.is_frozen_at(START + SECOND)
    assert odometry.thaws_with(Odometry(START + SECOND, np.array([1.0, 2.0, 0.6]), IDENTITY))


@pytest.mark.parametrize(("moved", "is_told"), [(0.3, False), (2.0, True)])
def test_only_what_a_stop_cannot_explain_is_told(moved: float, is_told: bool) -> None:
    """Which is no reproach where the robot was carried."""
    warning = frozen(moved).warning(START)
    assert (warning is not None) == is_told
    assert not is_told or "Unless the robot was carried, find out why" in str(warning)


poses = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-np.pi, np.pi)).map(np.array)
speeds = st.tuples(st.floats(-14.0, 14.0), st.floats(-3.0, 3.0), st.floats(-15.0, 15.0)).map(np.array)


@given(poses, speeds, st.floats(0.0, 3.0))
def test_no_car_jumps_however_it_drives(before: np.ndarray, speed: np.ndarray, seconds: float) -> None:
    assert not is_jump(before, compose(before, speed * seconds), seconds)


@given(poses, speeds, st.sampled_from([0.01, 0.02, 0.04]))
def test_messages_that_are_stamped_as_they_come_are_no_jump(
    before: np.ndarray, speed: np.ndarray, period: float
) -> None:
    """In a bunch, a tenth of a millisecond apart."""
    assert not is_jump(before, compose(before, 0.8 * speed * period), 1e-4)


@given(poses, st.floats(-np.pi, np.pi), st.floats(1.5, 100.0))
def test_another_origin_is_a_jump(before: np.ndarray, direction: float, metres: float) -> None:
    away = np.array([metres * np.cos(direction), metres * np.sin(direction), 0.0])
    assert is_jump(before, before + away, 0.02)


@pytest.mark.parametrize("turn", [1.0, -2.0, np.pi, 2.0 * np.pi - 1.0])
def test_a_turn_on_the_spot_within_no_time_is_a_jump(turn: float) -> None:
    assert is_jump(IDENTITY, np.array([0.0, 0.0, turn]), 0.02)
