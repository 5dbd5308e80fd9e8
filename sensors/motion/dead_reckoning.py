"""Dead reckoning: the laser's motion since the last keyframe, from wheels and gyroscope, scans and a constant
velocity."""

from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import (
    IDENTITY,
    Pose,
    are_apart,
    between,
    compose,
    inverse,
    transform_points,
)
from racecar.sensors.matching.scan_store import PreparedScan
from racecar.sensors.motion.calibration import WheelCalibration
from racecar.sensors.motion.deskew import (
    LaserMotion,
    by_odometry,
    by_velocity,
    deskew,
    deskew_cloud,
    seen_by,
)
from racecar.sensors.motion.gyro_buffer import GyroReading, turn_between
from racecar.sensors.motion.lag import OdometryLag
from racecar.sensors.motion.motion_guesses import GuessSource, MotionGuesses
from racecar.sensors.motion.motion_samples import MotionSamples
from racecar.sensors.motion.mounts import Mounts
from racecar.sensors.motion.scan_odometry import ScanOdometry
from racecar.sensors.motion.turn_fusion import TurnFusion
from racecar.sensors.motion.turn_search import with_turn_seen
from racecar.sensors.motion.velocity_filter import TurnMeasured, VelocityFilter
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_LOST = 1.0, 0.5
"""Metres and radians by which scan odometry may miss a step between keyframes before it is restarted. Chosen
by judgement: it misses by less unless it is lost."""
_UNSEEN_TURN = 0.2
"""Radians of turn in the scans, while the wheels repeat the exact same heading, after which that heading is
ignored. Chosen by judgement: session_A's car turned by up to 0.09 while it steered straight."""
_SPARSE_INTERVAL = 0.075
"""Seconds between two scans above which scan odometry corrects the velocity filter. When scans come more
often, the laser moves too little between them. Measured on simulated cheap lasers (pytest
tests/simulated/test_hard_places.py)."""
_BLIND_INTERVAL = 2_000_000_000
"""Nanoseconds without any return during which a car without wheel odometry is assumed to keep its motion;
after that it is searched for around where it was by then. Chosen by judgement: the same as the gap after
which it is searched for."""
UNMEASURED = np.diag(np.array([1.0, 1.0, 1.5]) ** -2.0)
"""(3, 3) information of motion over a longer time that nothing measured: m, m, rad. Chosen by judgement: a
car may go this far before anyone wonders."""


class _Moment(NamedTuple):
    """A scan's stamp and the reference's pose at that time by each source, each in its own frame."""

    stamp: int = 0
    """Nanoseconds."""
    by_scans: Pose = IDENTITY
    by_wheels: Pose | None = None
    by_gyro: GyroReading | None = None


class DeadReckoning:
    """Tracks the laser from scan to scan; none of its guesses can be trusted alone.

    Wheels slip, and some logs count backwards. Scan odometry sticks along bare corridors and arcs. A car does
    not always keep its velocity. Matching a keyframe from each guess shows which one is right.
    """

    def __init__(self, odometry_lag: int = 0) -> None:
        """``odometry_lag`` in nanoseconds, if known beforehand."""
        self.calibration = WheelCalibration()
        self.scans_without_odometry = 0
        self.scans_left_out = 0
        """Number of scans of additional lasers."""
        self.mounts = Mounts()
        """Mounts as of the latest scans; the motion is that of the reference among them."""
        self.blind_for = 0
        """Nanoseconds since the previous scan with any return; zero without one."""
        self.odometry_lag = OdometryLag(odometry_lag)
        """The lag as last learned."""
        self.cloud: NDArray[np.float64] | None = None
        """(N, 3) points of the last scan of a multi-row sensor, corrected for motion, in its levelled frame;
        None for a planar one."""
        self.turns = TurnFusion()
        """How reliable the turns from wheels and gyroscope have proven to be."""
        self._unseen_turn = 0.0
        """Radians of turn in the scans since the wheels began to repeat a heading."""
        self._samples = MotionSamples(odometry_lag)
        self.frozen = self._samples.frozen
        """The times at which the wheels repeated a pose while the scans moved."""
        self._scan_odometry = ScanOdometry()
        self._filter = VelocityFilter()
        self._points: NDArray[np.float64] = np.zeros((0, 2))
        self._sweep: NDArray[np.float64] = np.zeros((0, 2))
        self._now = self._keyframe = _Moment()
        self._seeing_stamp = 0
        self._last_motion: Pose = IDENTITY
        self._velocity: Pose = IDENTITY

    def add_odometry(self, odometry: Odometry) -> None:
        """Add a wheel odometry sample; one that does not continue the previous sample restarts it."""
        if self._samples.add_odometry(odometry):
            self._forget_wheels()

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample."""
        self._samples.add_yaw_rate(yaw_rate)

    def can_follow(self, scan: Scan) -> bool:
        """Whether the motion to a scan is known; for an additional laser only wheels can measure it."""
        if not self.mounts.is_further(scan.laser):
            return True
        can = self._keyframe.by_wheels is not None and self._samples.odometry.covers(scan.stamp)
        self.scans_left_out += not can
        return can

    def advance(self, scan: Scan) -> tuple[NDArray[np.float64], MotionGuesses]:
        """Advance to the next scan. Returns its motion-corrected end points (M, 2) in the frame of its laser,
        and the motion guesses."""
        self._place_laser(scan)
        self.blind_for = scan.stamp - self._seeing_stamp if self._seeing_stamp else 0
        mount = self.mounts.of(scan.laser)
        last, reading = self._now, self._samples.reading_at(scan.stamp)
        odom_from_base, by_gyro = reading.odom_from_base, reading.by_gyro
        self.scans_without_odometry += odom_from_base is None
        to_reference = self.mounts.base_from_reference
        odom_from_reference = None if odom_from_base is None else compose(odom_from_base, to_reference)
        self._now = last._replace(by_wheels=odom_from_reference, by_gyro=by_gyro)
        gyro_turn, seconds = turn_between(last.by_gyro, by_gyro), (scan.stamp - last.stamp) * 1e-9
        by_wheels = _step(last.by_wheels, self._now.by_wheels)
        if by_wheels is not None:
            self.turns.watch(by_wheels, gyro_turn, seconds)
        turned = self._measured_turn(gyro_turn, seconds, scan)
        keyframe_from_last = self._filter.keyframe_from_laser
        is_followed = self.wheel_step() is None and self._filter.advance(scan, mount, turned)
        is_trusted = is_followed and self._filter.is_trusted
        steadily = seen_by(mount, by_velocity(self._filter.velocity))
        within = steadily if is_trusted else self._motion_in_sweep(scan, turned)
        in_laser, self.cloud = deskew(scan, within), deskew_cloud(scan, within)
        points = _from_reference(mount, in_laser)
        if by_wheels is not None:
            motion = self.corrected(by_wheels, gyro_turn, seconds)
        elif is_trusted:
            motion = between(keyframe_from_last, self._filter.keyframe_from_laser)
        elif len(points) == 0 and self.blind_for > _BLIND_INTERVAL:
            motion = IDENTITY
        elif turned is not None:
            motion = np.array([*self._last_motion[:2], turned.turn])
        else:
            motion = with_turn_seen(self._points, points, self._last_motion)
        self._points = points
        self._sweep = points if self.cloud is None else _from_reference(mount, self.cloud)
        by_scans = self._scan_odometry.register(self._sweep, motion)
        self._last_motion = between(last.by_scans, by_scans)
        self._now = self._now._replace(stamp=scan.stamp, by_scans=by_scans)
        if len(points) > 0:
            self._seeing_stamp = scan.stamp
        if is_followed and seconds > _SPARSE_INTERVAL:
            self._filter.observe(between(self._keyframe.by_scans, by_scans))
        guesses = self.guesses()
        if not is_followed:
            self._filter.begin(scan.stamp, guesses.best, self._last_motion / max(seconds, 1e-3))
        return in_laser, guesses

    def guesses(self) -> MotionGuesses:
        """Guesses of keyframe_from_laser by every source that has one."""
        by: dict[GuessSource, Pose] = {}
        step = self.wheel_step()
        if step is not None:
            by[GuessSource.WHEELS_OR_FILTER] = self.corrected(step, *self.gyro_step())
        elif self._filter.is_trusted:
            by[GuessSource.WHEELS_OR_FILTER] = self._filter.keyframe_from_laser
        by[GuessSource.SCAN_ODOMETRY] = between(self._keyframe.by_scans, self._now.by_scans)
        by[GuessSource.STEADY_VELOCITY] = self._velocity * (self._now.stamp - self._keyframe.stamp)
        return MotionGuesses(by)

    def wheel_step(self) -> Pose | None:
        """(3,) keyframe_from_laser as measured by the wheels, uncorrected; None if they did not."""
        return _step(self._keyframe.by_wheels, self._now.by_wheels)

    @property
    def wheels_begin(self) -> bool:
        """Whether the wheels report a pose now but did not at the last keyframe. They only measure motion
        from the next keyframe on, and where scan odometry sticks that one may take long to come."""
        return self._now.by_wheels is not None and self._keyframe.by_wheels is None

    @property
    def wheels_repeat(self) -> bool:
        """Whether the wheels report that the car stands; frozen wheels report the same."""
        return self._samples.repeats(self._now.stamp)

    def judge_repeating(self, step: Pose, source: GuessSource, limits: tuple[float, float]) -> None:
        """Ignore wheels that repeat a pose or heading, until it changes, if the scans contradict them: they
        show a ``step`` (3,) since the last keyframe, found from the guess of a ``source``.

        They contradict a pose where another guess was right, or where an entire step above the limits
        (metres, radians) was made meanwhile. A heading also repeats while the car steers straight, so several
        steps together have to show a turn; where a gyroscope measures it, the wheels' turn is not needed.
        """
        begin = self._samples.repeats_since(self._now.stamp)
        if begin is not None:
            if source != GuessSource.WHEELS_OR_FILTER or (
                self._is_since_keyframe(begin) and are_apart(step, IDENTITY, limits)
            ):
                self._leave_out_wheels(begin)
            return
        begin = self._samples.repeats_since(self._now.stamp, heading_only=True)
        is_unseen = begin is not None and self._is_since_keyframe(begin) and isnan(self.gyro_step()[0])
        self._unseen_turn = self._unseen_turn + float(step[2]) if is_unseen else 0.0
        if begin is not None and abs(self._unseen_turn) > _UNSEEN_TURN:
            self._leave_out_wheels(begin, heading_only=True)

    def doubt_standing(self) -> None:
        """Ignore wheels that repeat a pose, until it changes: a standing car would see the last keyframe
        again, but this one does not."""
        begin = self._samples.repeats_since(self._now.stamp)
        if begin is not None and self._now.by_wheels is not None:
            self._leave_out_wheels(begin)

    def _is_since_keyframe(self, begin: int) -> bool:
        """Whether the odometry has repeated itself since a stamp (nanoseconds) for the entire step."""
        return begin - self._samples.odometry.lag <= self._keyframe.stamp

    def _leave_out_wheels(self, begin: int, *, heading_only: bool = False) -> None:
        """Ignore the pose or heading that the wheels have repeated since a stamp."""
        self._samples.leave_out_odometry(begin, heading_only=heading_only)
        self._forget_wheels()
        self._unseen_turn = 0.0

    def _forget_wheels(self) -> None:
        """Discard the wheels' poses so far."""
        self._now, self._keyframe = (each._replace(by_wheels=None) for each in (self._now, self._keyframe))

    def prior(self, step: Pose) -> NDArray[np.float64]:
        """(3, 3) information of the most trusted guess of a ``step`` (3,) since the last keyframe."""
        is_long = self._now.stamp - self._keyframe.stamp > _BLIND_INTERVAL
        return UNMEASURED if is_long and self.wheel_step() is None else self.calibration.prior(step)

    def gyro_step(self) -> tuple[float, float]:
        """The turn since the last keyframe as measured by the gyroscope, and the seconds in between.

        Radians, NaN if it did not measure it.
        """
        seconds = (self._now.stamp - self._keyframe.stamp) * 1e-9
        return turn_between(self._keyframe.by_gyro, self._now.by_gyro), seconds

    def corrected(self, steps: Pose, gyro_turns: ArrayLike, seconds: ArrayLike) -> Pose:
        """Wheel steps (..., 3) of the reference, corrected for systematic errors and fused with the
        gyroscope's turns."""
        return self.fused(self.calibration.faults.corrected(steps), gyro_turns, seconds)

    def fused(self, steps: Pose, gyro_turns: ArrayLike, seconds: ArrayLike) -> Pose:
        """Corrected steps (..., 3) of the reference, fused with the gyroscope's turns."""
        if not self.turns.model.is_used:
            return steps
        base_from_reference = self.mounts.base_from_reference
        base_steps = compose(compose(base_from_reference, steps), inverse(base_from_reference))
        fused = self.turns.model.fused(base_steps, gyro_turns, seconds)
        return compose(compose(inverse(base_from_reference), fused), base_from_reference)

    def start_keyframe(
        self, step: Pose, keyframe: PreparedScan, laser: int = 0, *, is_matched: bool = True
    ) -> None:
        """Make the current scan, of a ``laser``, the keyframe. The reference moved by ``step`` (3,) since the
        last one; the scans show this step if it ``is_matched``."""
        if is_matched:
            self._learn_turn(step)
        else:
            self.turns.start_anew()
        self._filter.start_keyframe(keyframe, self.mounts.of(laser))
        if are_apart(step, between(self._keyframe.by_scans, self._now.by_scans), _LOST):
            self._begin_scan_odometry()
        self.frozen.follow(self._now.stamp, step)
        self.odometry_lag.add_turn(self._now.stamp, float(step[2]))
        self._velocity = step / max(self._now.stamp - self._keyframe.stamp, 1)
        self._keyframe = self._now

    def learn_lag(self) -> None:
        """Learn how late odometry is stamped, and apply it; the current scan must be the keyframe."""
        odometry = self._samples.odometry
        if self.odometry_lag.learn(odometry):
            odometry.lag = self.odometry_lag.nanoseconds
            if self._now.by_wheels is not None:
                odom_from_base = odometry.pose_at(self._now.stamp)
                by_wheels = compose(odom_from_base, self.mounts.base_from_reference)
                self._now = self._keyframe = self._now._replace(by_wheels=by_wheels)

    def _learn_turn(self, step: Pose) -> None:
        """Compare the turn of the step (3,) between two keyframes with those of wheels and gyroscope."""
        gyro_turn, seconds = self.gyro_step()
        by_wheels = self.wheel_step()
        corrected = None if by_wheels is None else self.calibration.faults.corrected(by_wheels)
        self.turns.follow(seconds, float(step[2]), gyro_turn, corrected)

    def _measured_turn(self, gyro_turn: float, seconds: float, scan: Scan) -> TurnMeasured | None:
        """The motion between two scans as measured by a gyroscope that has proven right."""
        model = self.turns.model
        if not model.is_used or isnan(gyro_turn) or seconds <= 0.0:
            return None
        turn = model.by_gyro(gyro_turn, seconds)
        sweep = float(scan.time_offsets.max(initial=0.0))
        begin, end = self._samples.gyro.angles_at([scan.stamp, scan.stamp + round(sweep * 1e9)]).tolist()
        rate = model.by_gyro(end - begin, sweep) / sweep if sweep > 1e-3 else turn / seconds
        variance = model.variance_by_gyro(turn, seconds)
        return TurnMeasured(turn, variance, rate, self.mounts.base_from_reference)

    def _motion_in_sweep(self, scan: Scan, turned: TurnMeasured | None) -> LaserMotion:
        """Motion from the wheels, with the gyroscope's turn where it is trusted."""
        if turned is None:
            return by_odometry(scan, self._samples.odometry)
        if len(self._samples.odometry) == 0:
            return by_velocity(np.array([0.0, 0.0, turned.rate_in_sweep]))
        at_stamp = self._samples.gyro.angles_at([scan.stamp])

        def correction(steps: Pose, seconds: NDArray[np.float64], stamps: NDArray[np.int64]) -> Pose:
            turns = self._samples.gyro.angles_at(stamps) - at_stamp
            return self.turns.model.fused(steps, turns, np.abs(seconds))

        return by_odometry(scan, self._samples.odometry, correction)

    def _begin_scan_odometry(self) -> None:
        """Restart at the current scan.

        Once lost, scan odometry keeps the motion that misled it, moving to where its local map is empty and
        nothing corrects it.
        """
        self._scan_odometry = ScanOdometry()
        self._now = self._now._replace(by_scans=self._scan_odometry.register(self._sweep, IDENTITY))
        self._last_motion = IDENTITY

    def forget_old_scans(self) -> None:
        """Drop old scans of scan odometry; only the motion since the last keyframe is needed."""
        self._scan_odometry.forget_old()

    def _place_laser(self, scan: Scan) -> None:
        """Update the mount; until it is known the wheels' poses are those of another point."""
        moved = self.mounts.take(scan)
        if moved is None:
            return
        self._now, self._keyframe = (
            each if each.by_wheels is None else each._replace(by_wheels=compose(each.by_wheels, moved))
            for each in (self._now, self._keyframe)
        )


def _step(first: Pose | None, second: Pose | None) -> Pose | None:
    """The motion (3,) from one pose to another; None if either is unknown."""
    return None if first is None or second is None else between(first, second)


def _from_reference(mount: Pose | None, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (N, 2) or (N, 3) of a laser at ``mount`` (3,) in the frame of the reference."""
    if mount is None:
        return points
    return np.column_stack([transform_points(mount, points[:, :2]), points[:, 2:]])
