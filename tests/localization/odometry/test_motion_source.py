import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.motion_source import MotionSource
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.odometry import Odometry
from racecar.sensors.yaw_rate import YawRate

MILLISECOND, SECOND = 1_000_000, 1_000_000_000


def source(**settings: float) -> MotionSource:
    return MotionSource(LocalizationConfig.model_validate(settings))


def true_pose(stamp: int) -> Pose:
    """Where the odometry says the car is: on a winding way."""
    t = stamp * 1e-9
    return np.array([1.5 * t, np.sin(t), np.arctan2(np.cos(t), 1.5)])


def sample(stamp: int) -> Odometry:
    return Odometry(stamp, true_pose(stamp), IDENTITY)


def feed(motion: MotionSource, start: int, end: int, period: int = 20 * MILLISECOND) -> None:
    for stamp in range(start, end, period):
        motion.samples.add_odometry(sample(stamp))


def sum_of(steps: list[MotionStep]) -> Pose:
    total = IDENTITY
    for step in steps:
        total = compose(total, step.base_from_next_base)
    return total


def assert_same_poses(told: Pose, expected: Pose, atol: float = 1e-7) -> None:
    np.testing.assert_allclose(between(expected, told), 0.0, atol=atol)


gaps = st.integers(5, 60)


@settings(max_examples=60)
@given(
    odometry_gaps=st.lists(gaps, min_size=40, max_size=80),
    scan_gaps=st.lists(gaps, min_size=10, max_size=30),
    lags=st.lists(st.integers(-60, 250), min_size=30, max_size=30),
    questions=st.lists(st.integers(-300, 300), max_size=30),
)
def test_however_messages_interleave_no_motion_is_lost_or_counted_twice(
    odometry_gaps: list[int], scan_gaps: list[int], lags: list[int], questions: list[int]
) -> None:
    """Odometry comes late and early beside the scans, and others ask for the motion meanwhile."""
    motion = source()
    odometry_stamps = list(np.cumsum([0, *odometry_gaps]) * MILLISECOND)
    scan_stamps = [int(s) for s in np.cumsum(scan_gaps) * MILLISECOND if s < odometry_stamps[-1]]
    motion.samples.add_odometry(sample(0))
    fed, steps = 1, []
    for i, stamp in enumerate(scan_stamps):
        is_end = i in (0, len(scan_stamps) - 1)
        reach = stamp + 100 * MILLISECOND if is_end else stamp - lags[i] * MILLISECOND
        while fed < len(odometry_stamps) and odometry_stamps[fed] <= reach:
            motion.samples.add_odometry(sample(int(odometry_stamps[fed])))
            fed += 1
        steps.append(motion.step_to(stamp))
        if i < len(questions):
            asked = stamp + questions[i] * MILLISECOND
            motion.step_from(motion.reading, OdometryFaults(), asked)
    told = motion.reading.odom_from_base
    assert told is not None
    assert all(np.isfinite(step.travel) for step in steps[1:])
    assert steps[0].seconds == 0.0
    assert sum(step.seconds for step in steps) == pytest.approx((scan_stamps[-1] - scan_stamps[0]) * 1e-9)
    exact = source()
    for stamp in odometry_stamps:
        exact.samples.add_odometry(sample(int(stamp)))
    first, last = exact.samples.poses_at(np.array([scan_stamps[0], scan_stamps[-1]]))
    assert_same_poses(told, last)
    assert_same_poses(sum_of(steps[1:]), between(first, last))


@settings(max_examples=60)
@given(st.integers(0, 1000), st.integers(0, 1100))
def test_the_motion_between_two_stamps_is_that_of_the_odometry(since: int, until: int) -> None:
    motion = source()
    feed(motion, 0, SECOND + 1, MILLISECOND * 2)
    before, after = motion.samples.poses_at(np.array([since, until]) * MILLISECOND)
    step = motion.step_from(
        motion.samples.reading_at(since * MILLISECOND), OdometryFaults(), until * MILLISECOND
    )
    assert_same_poses(step.base_from_next_base, between(before, after))
    assert_same_poses(before, true_pose(since * MILLISECOND), atol=1e-5)
    assert step.seconds == pytest.approx((until - since) * 1e-3)
    assert np.all(step.deviations[[0, 2]] > 0.0) == (since != until)


def test_late_and_broken_samples_change_nothing() -> None:
    clean, disturbed = source(), source()
    for stamp in range(0, SECOND, 20 * MILLISECOND):
        clean.samples.add_odometry(sample(stamp))
        disturbed.samples.add_odometry(sample(stamp))
        for strange in (
            Odometry(stamp - 500 * MILLISECOND, np.array([50.0, 0.0, 1.0]), IDENTITY),
            Odometry(stamp, np.array([50.0, 0.0, 1.0]), IDENTITY),
            Odometry(stamp + 10 * MILLISECOND, np.array([np.nan, 0.0, 0.0]), IDENTITY),
            Odometry(-(10**15), np.array([0.0, np.inf, 0.0]), IDENTITY),
        ):
            disturbed.samples.add_odometry(strange)
        steps = [motion.step_to(stamp) for motion in (clean, disturbed)]
        np.testing.assert_array_equal(steps[0].base_from_next_base, steps[1].base_from_next_base)
        assert steps[0].travel == steps[1].travel


@pytest.mark.parametrize("aside", [(100.0, -40.0, 2.0), (1.5, 0.0, 0.0), (0.0, 0.0, -1.5)])
def test_over_a_jump_the_car_goes_on_as_before_and_then_by_the_odometry_again(
    aside: tuple[float, float, float],
) -> None:
    motion = source()
    for k in range(100):
        stamp = k * 20 * MILLISECOND
        pose = np.array([0.02 * k, 0.0, 0.0])
        motion.samples.add_odometry(
            Odometry(stamp, pose if k < 50 else compose(np.array(aside), pose), IDENTITY)
        )
        step = motion.step_to(stamp)
        motion.learn(np.array([0.02, 0.0, 0.0]), is_known=True)
        if k > 10:
            assert_same_poses(step.base_from_next_base, np.array([0.02, 0.0, 0.0]), atol=1e-3)
        assert np.isinf(step.travel) == (k in (0, 50))


def test_nobody_is_carried_over_a_jump() -> None:
    """Who asks for now, from a pose that was estimated before the odometry jumped."""
    motion = source()
    for k in range(50):
        motion.samples.add_odometry(Odometry(k * 20 * MILLISECOND, np.array([0.02 * k, 0.0, 0.0]), IDENTITY))
        motion.step_to(k * 20 * MILLISECOND)
        motion.learn(np.array([0.02, 0.0, 0.0]), is_known=True)
    for k in (50, 51):
        motion.samples.add_odometry(Odometry(k * 20 * MILLISECOND, np.array([0.02 * k, 4.0, 1.0]), IDENTITY))
    step = motion.step_from(motion.reading, OdometryFaults(), 51 * 20 * MILLISECOND)
    assert_same_poses(step.base_from_next_base, np.array([0.04, 0.0, 0.0]), atol=2e-3)


def test_when_the_odometry_starts_anew_its_jump_home_is_no_motion() -> None:
    """The driver was started again and counts from zero, its clock set back; the scans' clock is not."""
    motion = source()
    feed(motion, 10 * SECOND, 11 * SECOND)
    motion.step_to(11 * SECOND - 20 * MILLISECOND)
    motion.samples.add_odometry(Odometry(2 * SECOND, IDENTITY, IDENTITY))
    motion.samples.add_odometry(Odometry(2 * SECOND + 20 * MILLISECOND, np.array([0.1, 0.0, 0.0]), IDENTITY))
    step = motion.step_to(11 * SECOND)
    assert np.isinf(step.travel)
    assert_same_poses(step.base_from_next_base, IDENTITY)


def test_an_odometry_that_ran_ahead_and_starts_anew_is_not_compared_with_its_past() -> None:
    motion = source()
    for stamp in range(9 * SECOND, 12 * SECOND, 20 * MILLISECOND):
        motion.samples.add_odometry(Odometry(stamp, np.array([3.0, 0.0, 0.0]), IDENTITY))
    motion.step_to(10 * SECOND)
    for stamp in range(10 * SECOND, 10 * SECOND + 400 * MILLISECOND, 20 * MILLISECOND):
        motion.samples.add_odometry(Odometry(stamp, IDENTITY, IDENTITY))
    first, second = (motion.step_to(10 * SECOND + ms * MILLISECOND) for ms in (100, 200))
    for step in (first, second):
        assert_same_poses(step.base_from_next_base, IDENTITY)
    assert np.isinf(first.travel)
    assert second.travel == 0.0


def test_after_a_restart_of_all_clocks_motion_is_measured_again() -> None:
    motion = source()
    feed(motion, 10 * SECOND, 11 * SECOND)
    motion.step_to(11 * SECOND - 20 * MILLISECOND)
    feed(motion, 2 * SECOND, 3 * SECOND)
    back = motion.step_to(2 * SECOND + 500 * MILLISECOND)
    assert np.isinf(back.seconds)
    assert np.isinf(back.travel)
    assert back.is_over_gap
    step = motion.step_to(2 * SECOND + 600 * MILLISECOND)
    ends = (true_pose(2 * SECOND + ms * MILLISECOND) for ms in (500, 600))
    assert_same_poses(step.base_from_next_base, between(*ends), atol=1e-4)


@pytest.mark.parametrize(("seconds", "is_over_gap"), [(1.9, False), (2.1, True), (600.0, True)])
def test_a_long_pause_between_scans_is_a_gap(seconds: float, is_over_gap: bool) -> None:
    motion = source()
    feed(motion, 0, SECOND)
    motion.step_to(SECOND)
    step = motion.step_to(SECOND + int(seconds * SECOND))
    assert step.is_over_gap == is_over_gap
    assert step.seconds == pytest.approx(seconds)
    assert np.isinf(step.travel)


def test_without_odometry_the_speed_of_the_estimates_is_carried_on() -> None:
    motion = source(drift_noise=0.3)
    for k in range(100):
        step = motion.step_to(k * 20 * MILLISECOND)
        motion.learn(np.array([0.04, 0.0, 0.0]), is_known=True)
    assert_same_poses(step.base_from_next_base, np.array([0.04, 0.0, 0.0]), atol=1e-3)
    np.testing.assert_allclose(step.deviations, 0.3 * np.sqrt(0.02))
    far = motion.step_from(motion.reading, OdometryFaults(), 20 * SECOND)
    assert_same_poses(far.base_from_next_base, np.array([1.0, 0.0, 0.0]), atol=0.02)
    motion.start_anew()
    assert_same_poses(motion.step_to(2 * SECOND).base_from_next_base, IDENTITY)


def test_in_a_sweep_the_car_moves_as_odometry_tells_or_else_at_the_speed_of_the_estimates() -> None:
    motion, stamps = source(), SECOND + MILLISECOND * np.array([0, 5, 15])
    motion.step_to(SECOND)
    assert_same_poses(motion.poses_in_sweep(stamps), np.zeros((3, 3)))
    motion.speed = np.array([2.0, 0.0, 0.0])
    moved = between(*motion.poses_in_sweep(stamps)[[0, 2]])
    assert_same_poses(moved, np.array([0.03, 0.0, 0.0]), atol=1e-3)
    feed(motion, 0, 2 * SECOND)
    motion.step_to(SECOND)
    moved = between(*motion.poses_in_sweep(stamps)[[0, 2]])
    assert_same_poses(moved, between(true_pose(stamps[0]), true_pose(stamps[2])), atol=1e-3)


def test_a_car_that_stands_gains_no_noise_but_one_whose_wheels_lock_may_slide_on() -> None:
    motion = source()
    for k in range(200):
        stamp = k * 20 * MILLISECOND
        motion.samples.add_odometry(Odometry(stamp, np.array([0.06 * min(k, 50), 0.0, 0.0]), IDENTITY))
        step = motion.step_to(stamp)
        if k == 52:
            assert step.deviations[0] > 0.005
            assert step.travel > 0.01
    assert np.all(step.deviations == 0.0)
    assert step.travel == 0.0


def test_tyres_are_pushed_along_the_car_when_it_brakes_and_across_it_in_bends() -> None:
    def effort(turn: float, brakes_at: int) -> np.ndarray:
        motion, pose, efforts = source(), IDENTITY, []
        for k in range(80):
            motion.samples.add_odometry(Odometry(k * 20 * MILLISECOND, pose, IDENTITY))
            efforts.append(motion.step_to(k * 20 * MILLISECOND).effort)
            if k < brakes_at:
                pose = compose(pose, [0.06, 0.0, turn])
        return np.asarray(np.max(efforts[50:], axis=0))

    assert np.all(effort(0.0, 80) < 0.1)
    assert effort(0.0, 60)[0] > 0.9
    assert effort(0.0, 60)[1] < 0.1
    assert effort(0.02, 80)[1] == pytest.approx(3.0 / 4.0, rel=0.05)


def test_other_settings_hold_from_then_on() -> None:
    motion = source(path_noise_per_metre=0.01, slip=0.0)
    feed(motion, 0, SECOND)
    motion.step_to(0)
    quiet = motion.step_to(200 * MILLISECOND)
    motion.config = LocalizationConfig(path_noise_per_metre=0.5, slip=0.0)
    loud = motion.step_to(400 * MILLISECOND)
    assert loud.deviations[0] > 10 * quiet.deviations[0]
    assert_same_poses(sum_of([quiet, loud]), between(true_pose(0), true_pose(400 * MILLISECOND)), atol=1e-4)


def test_a_speed_lasts_for_a_moment_past_the_latest_odometry_and_a_gap_is_told() -> None:
    motion = source()
    feed(motion, 0, SECOND)
    motion.step_to(900 * MILLISECOND)
    latest = 980 * MILLISECOND
    far = np.array([latest + 400 * MILLISECOND])
    near = np.array([latest + 100 * MILLISECOND])
    assert_same_poses(motion.samples.poses_at(far), motion.samples.poses_at(near))
    assert np.abs(motion.samples.poses_at(far) - true_pose(latest)).max() > 0.01
    assert not motion.step_to(2500 * MILLISECOND).is_over_gap
    assert motion.step_to(5000 * MILLISECOND).is_over_gap


def test_what_a_car_is_behind_adds_up_to_what_it_has_turned_in_a_tenth_of_a_second() -> None:
    """It follows a bend that the odometry begins at once, and goes on bending when that is over."""
    motion, pose, behind = source(), IDENTITY, []
    for k in range(151):
        motion.samples.add_odometry(Odometry(k * 20 * MILLISECOND, pose, IDENTITY))
        behind.append(motion.step_to(k * 20 * MILLISECOND).behind)
        pose = compose(pose, [0.04, 0.0, 0.03 if 50 <= k < 100 else 0.0])
    turn = np.array(behind)[:, 2]
    np.testing.assert_allclose(turn[:51], 0.0, atol=1e-9)
    assert turn[51:101].sum() == pytest.approx(-1.5 * 0.1, rel=0.15)
    assert turn[101:].sum() == pytest.approx(1.5 * 0.1, rel=0.15)
    np.testing.assert_allclose(np.array(behind)[:, :2], 0.0, atol=2e-3)


def turning_source(*, has_odometry: bool) -> MotionSource:
    """Half a minute of wheels that overstate turns by half, beside estimates that show the truth."""
    motion, last = source(), true_pose(0)
    for k in range(30 * 50):
        stamp = k * 20 * MILLISECOND
        pose = true_pose(stamp)
        motion.samples.add_yaw_rate(YawRate(stamp, yaw_rate(stamp) + 0.04))
        if has_odometry:
            motion.samples.add_odometry(Odometry(stamp, np.array([*pose[:2], 1.5 * pose[2]]), IDENTITY))
        if k % 5 == 0:
            motion.step_to(stamp)
            motion.learn(between(last, pose), is_known=k > 0)
            last = pose
    return motion


def yaw_rate(stamp: int) -> float:
    t = stamp * 1e-9
    return float(-1.5 * np.sin(t) / (1.5**2 + np.cos(t) ** 2))


@pytest.mark.parametrize("has_odometry", [True, False])
def test_a_gyroscope_that_has_proven_right_measures_the_turn(has_odometry: bool) -> None:
    motion = turning_source(has_odometry=has_odometry)
    last, now = 1495 * 20 * MILLISECOND, 1499 * 20 * MILLISECOND
    assert motion.turns.model.is_believed
    true = between(true_pose(last), true_pose(now))
    step = motion.step_from(motion.reading, OdometryFaults(), now)
    assert step.base_from_next_base[2] == pytest.approx(true[2], abs=1e-3)
    in_sweep = motion.poses_in_sweep(np.array([last, now]))
    assert between(*in_sweep)[2] == pytest.approx(true[2], abs=1e-3)
    assert motion.step_to(now).base_from_next_base[2] == pytest.approx(true[2], abs=1e-3)


def test_a_gyroscope_whose_clock_is_set_back_begins_anew() -> None:
    motion = turning_source(has_odometry=True)
    for k in range(10):
        motion.samples.add_yaw_rate(YawRate((10 + k) * 20 * MILLISECOND, 0.1 * k))
    step = motion.step_from(motion.reading, OdometryFaults(), 15 * 20 * MILLISECOND)
    assert np.isfinite(step.base_from_next_base).all()
    motion.step_to(15 * 20 * MILLISECOND)
    assert motion.reading.by_gyro is not None
