"""The car's motion from one scan to the next: measured by odometry, or carried on where there is none."""

from dataclasses import replace
from math import isfinite, isnan, nan, sqrt
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.motion_model import drift_deviations, odometry_deviations, travel
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.speed_memory_kernels import SpeedMemory
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, wrap_angle
from racecar.maps.geometry.se2_kernels import step_between
from racecar.maps.sensing.config import TurnFusionConfig
from racecar.maps.sensing.frozen_odometry import FrozenOdometry
from racecar.maps.sensing.gyro_buffer import GyroBuffer, GyroReading, turn_between
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.odometry_buffer import STALE_AFTER, Extrapolation, OdometryBuffer
from racecar.maps.sensing.odometry_faults import OdometryFaults
from racecar.maps.sensing.turn_fusion import TurnFusion, turned_more
from racecar.maps.sensing.yaw_rate import YawRate

_RESTART = 1_000_000_000
"""By judgement: nanoseconds by which a clock must go back to count as set anew; by less, messages came out of
order."""
_GAP_SECONDS = 2.0
"""By judgement: between two scans; after a longer gap the car is searched for, because it may have been
carried anywhere."""
_EXTRAPOLATION = Extrapolation(100_000_000, speed_over=0, widest_gap=STALE_AFTER)
"""By judgement: of odometry: at the speed between its last two samples, while the next is on its way, for a
few periods of usual odometry (50 Hz)."""
_LONGEST_CARRY = 0.5
"""By judgement: seconds for which the speed of the estimates is taken to last where there is no odometry: a
car can stop within half a second."""
_SPEED_SECONDS = 0.15
"""By judgement: over which the speed of the estimates is averaged, some scans of a common sensor (40 Hz)."""


class MotionSource:
    """Gathers odometry and yaw rates, and gives the motion since the last scan.

    None of it is counted twice or lost.

    Odometry and yaw rates may come in from other threads at any time; the other methods belong to the thread
    that has the scan, but for `step_from`, which anyone may ask.
    """

    def __init__(self, config: LocalizationConfig) -> None:
        self._lock = Lock()
        self.calibration = OdometryCalibration()
        """Of the odometry; all steps are corrected by it."""
        self._odometry = OdometryBuffer(extrapolation=_EXTRAPOLATION)
        self.turns = TurnFusion(TurnFusionConfig())
        """What the turns by wheels and gyroscope have proven to be worth."""
        self.frozen = FrozenOdometry()
        """When the odometry repeated a pose while the car moved on."""
        self._gyro = GyroBuffer()
        self._by_gyro: GyroReading | None = None
        self._compared: tuple[float, float, Pose | None] = (0.0, nan, None)
        """The last step: seconds, and turn by the gyroscope and step by the wheels before they were fused."""
        self._known_heading: float | None = None
        self._laser_turn = 0.0
        """By which the scan of the last step was corrected."""
        self._restarts = 0
        self._followed_restarts = 0
        self._odom_from_base: Pose | None = None
        self._stamp: int | None = None
        self._memory = SpeedMemory()
        self._speed: Pose = IDENTITY
        self._last_estimate: tuple[int, Pose] | None = None
        self._config = config

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from here on."""
        self._config = config

    def add(self, odometry: Odometry) -> None:
        """Take a sample; one that is not finite or comes out of order is left out.

        Where its clock is set back or its poses jump, odometry begins anew.
        """
        if not isfinite(sum(odometry.odom_from_base.tolist())):
            return
        with self._lock:
            latest = self._odometry.latest_stamp
            is_set_back = latest is not None and latest - odometry.stamp > _RESTART
            if self.frozen.thaws_with(odometry) or is_set_back or self._odometry.jumps_to(odometry):
                self._odometry = OdometryBuffer(extrapolation=_EXTRAPOLATION)
                self._restarts += 1
            self._odometry.add(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take a sample of the gyroscope; one that is no number or comes out of order is left out."""
        with self._lock:
            latest = self._gyro.latest_stamp
            if latest is not None and latest - yaw_rate.stamp > _RESTART:
                self._gyro.start_anew()
            self._gyro.add(yaw_rate)

    def is_out_of_order(self, stamp: int) -> bool:
        """Whether a scan is older than that of the last step, but not because the clock was set back."""
        last = self._stamp
        return last is not None and 0 <= last - stamp < _RESTART

    def knows(self, stamp: int) -> bool:
        """Whether the odometry reaches to a stamp, or nearly."""
        latest = self._odometry.latest_stamp
        is_recent = latest is not None and stamp - latest <= STALE_AFTER
        return is_recent and not self.frozen.is_frozen_at(stamp)

    def poses_at(self, stamps: NDArray[np.int64]) -> Pose:
        """``odom_from_base`` (N, 3) at stamps (N,); past the latest sample, its speed lasts for a little.

        Raises LookupError while there is no odometry.
        """
        with self._lock:
            return self._odometry.pose_at(stamps)

    def repeats(self, stamp: int) -> bool:
        """Whether the odometry says that the car stands, by repeating one pose to the last bit."""
        with self._lock:
            return self.knows(stamp) and self._odometry.repeats_since(stamp) is not None

    def leave_out_odometry(self, stamp: int, speed: Pose) -> None:
        """The pose that the odometry repeats at a stamp is no motion; the car goes on at a speed (3,) per
        second until the odometry does."""
        with self._lock:
            begin = self._odometry.repeats_since(stamp)
            if begin is not None:
                self.frozen.freeze(begin, self._odometry.latest_pose)
        self._odom_from_base, self._speed, self._last_estimate = None, speed, None

    @property
    def speed(self) -> Pose:
        """(3,) of the estimates, metres and radians per second."""
        return self._speed

    def poses_in_sweep(self, stamps: NDArray[np.int64]) -> Pose:
        """Where the base is (N, 3) at stamps (N,) in the sweep of the last step, in a fixed frame.

        By odometry, or where that is silent by the speed of the estimates; with the turn by the gyroscope.
        """
        if self._odom_from_base is not None:
            poses = self.poses_at(stamps)
            if not self.turns.model.is_used or self._by_gyro is None or self._stamp is None:
                return poses
            steps = between(self._odom_from_base, poses)
            return self.turns.model.fused(
                steps, self._gyro_turns(stamps), np.abs(stamps - self._stamp) * 1e-9
            )
        seconds = np.zeros(len(stamps))
        if self._stamp is not None:
            seconds = np.asarray((stamps - self._stamp) * 1e-9, dtype=np.float64)
        poses = seconds[:, None] * self._speed
        if self.turns.model.is_used and self._by_gyro is not None:
            poses[:, 2] = self.turns.model.by_gyro(self._gyro_turns(stamps), seconds)
        return poses

    def _gyro_turns(self, stamps: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N,) radians since the last step, as measured."""
        if self._by_gyro is None:
            return np.full(len(stamps), np.nan)
        with self._lock:
            series, angles = self._gyro.series, self._gyro.angles_at(stamps)
        return (
            angles - self._by_gyro.angle if series == self._by_gyro.series else np.full(len(stamps), np.nan)
        )

    def step_to(self, stamp: int) -> MotionStep:
        """The motion since the last call."""
        with self._lock:
            is_restarted = self._followed_restarts != self._restarts
            self._followed_restarts = self._restarts
        if is_restarted:
            self._odom_from_base = None
        if self._stamp is None:
            seconds = 0.0
        elif self._stamp - stamp > _RESTART:
            seconds = np.inf
            self._odom_from_base = None
        else:
            seconds = max(stamp - self._stamp, 0) * 1e-9
        self._stamp = stamp
        before = self._odom_from_base
        self._odom_from_base = self.poses_at(np.array([stamp]))[0] if self.knows(stamp) else None
        gyro_before, self._by_gyro = self._by_gyro, self._reading_at(stamp)
        gyro_turn = turn_between(gyro_before, self._by_gyro)
        measured = self._measured(before, self._odom_from_base, seconds, gyro_turn)
        return self._with_laser_turned(measured or self._carried_on(seconds, gyro_turn))

    @property
    def by_gyro(self) -> GyroReading | None:
        """At the stamp of the last step; None without a gyroscope."""
        return self._by_gyro

    def _reading_at(self, stamp: int) -> GyroReading | None:
        with self._lock:
            return self._gyro.reading_at(stamp)

    @property
    def odom_from_base(self) -> Pose | None:
        """(3,) at the stamp of the last step; None without odometry."""
        return self._odom_from_base

    def step_from(
        self,
        odom_from_base: Pose | None,
        faults: OdometryFaults,
        since: int,
        stamp: int,
        by_gyro: GyroReading | None = None,
    ) -> MotionStep:
        """The motion from a stamp, at which the odometry said ``odom_from_base`` and the gyroscope
        ``by_gyro``, to another one.

        The answer is not remembered, so anyone may ask for the motion up to now.
        """
        seconds = (stamp - since) * 1e-9
        gyro_turn = nan if by_gyro is None else turn_between(by_gyro, self._reading_at(stamp))
        if odom_from_base is not None and self._remembers(since) and self.knows(stamp):
            step = faults.corrected(step_between(odom_from_base, self.poses_at(np.array([stamp]))[0]))
            if not isnan(gyro_turn):
                step = self.turns.model.fused(step, gyro_turn, seconds)
            return MotionStep(step, odometry_deviations(step, self._config), travel(step), seconds)
        return self._carried_on(seconds, gyro_turn)

    def learn_turn(self, map_from_base: Pose | None) -> None:
        """Compare the turn of the last step with the estimates.

        None where the place is not known, or does not continue the one before.
        """
        before, self._known_heading = self._known_heading, None
        if map_from_base is None:
            self.turns.start_anew()
            return
        self._known_heading = float(map_from_base[2])
        if before is not None:
            seconds, gyro_turn, by_wheels = self._compared
            turn = float(wrap_angle(self._known_heading - before))
            self.turns.follow(seconds, turn, gyro_turn, by_wheels)

    def follow(self, stamp: int, map_from_base: Pose) -> None:
        """Learn the car's speed from an estimate, for when odometry fails."""
        if self._last_estimate is not None:
            seconds = (stamp - self._last_estimate[0]) * 1e-9
            if 0.0 < seconds < _LONGEST_CARRY:
                speed = step_between(self._last_estimate[1], map_from_base) / seconds
                self.frozen.follow(stamp, speed * seconds)
                share = seconds / (seconds + _SPEED_SECONDS)
                self._speed = self._speed + share * (speed - self._speed)
        self._last_estimate = (stamp, map_from_base)

    def forget_speed(self) -> None:
        """The estimates to come do not continue those before."""
        self._speed, self._last_estimate = IDENTITY, None

    def _remembers(self, stamp: int) -> bool:
        """Whether the odometry has not begun anew since a stamp."""
        first = self._odometry.first_stamp
        return first is not None and first <= stamp

    def _measured(
        self, before: Pose | None, after: Pose | None, seconds: float, gyro_turn: float
    ) -> MotionStep | None:
        self._compared = seconds, gyro_turn, None
        if before is None or after is None:
            return None
        by_wheels = step_between(before, after)
        self.turns.watch(by_wheels, gyro_turn, seconds)
        step = self.calibration.faults.corrected(by_wheels)
        self._compared = seconds, gyro_turn, step
        model, wheel_share = self.turns.model, 1.0
        if model.is_used and not isnan(gyro_turn):
            wheel_share = float(model.wheel_share(step, model.by_gyro(gyro_turn, seconds), seconds))
            step = model.fused(step, gyro_turn, seconds)
        possible, effort, behind = self._memory.take(step, seconds)
        sliding = self._config.slip * (possible - np.abs(step))
        deviations = np.hypot(odometry_deviations(possible, self._config), sliding)
        if wheel_share < 1.0:
            behind = behind * np.array([1.0, 1.0, wheel_share])
        is_over_gap = seconds > _GAP_SECONDS
        return MotionStep(step, deviations, travel(possible), seconds, effort, behind, is_over_gap)

    def _with_laser_turned(self, step: MotionStep) -> MotionStep:
        """The step to where the base is by what is known now of how the laser is turned."""
        turn = self._laser_turn - self.calibration.laser_turn
        if turn == 0.0:
            return step
        self._laser_turn = self.calibration.laser_turn
        return replace(step, base_from_next_base=turned_more(step.base_from_next_base, turn))

    def _carried_on(self, seconds: float, gyro_turn: float) -> MotionStep:
        step = self._speed * float(np.clip(seconds, -_LONGEST_CARRY, _LONGEST_CARRY))
        noise = drift_deviations(min(abs(seconds), _GAP_SECONDS), self._config)
        model = self.turns.model
        if model.is_used and not isnan(gyro_turn):
            turn = model.by_gyro(gyro_turn, seconds)
            step = turned_more(step, turn - step[2])
            noise[2] = sqrt(model.variance_by_gyro(turn, abs(seconds)))
        return MotionStep(step, noise, np.inf, seconds, is_over_gap=seconds > _GAP_SECONDS)
