"""The car's motion from one scan to the next: measured by odometry, or extrapolated without it."""

from dataclasses import replace
from math import inf, isnan, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.motion_model import (
    MotionStep,
    drift_deviations,
    odometry_deviations,
    travel,
)
from racecar.localization.odometry.speed_memory import SpeedMemory
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.sensors.motion.motion_samples import (
    MeasuredMotion,
    MotionSamples,
    OdometryReading,
    is_set_back,
)
from racecar.sensors.motion.odometry_buffer import STALE_AFTER, Extrapolation
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.motion.turn_fusion import TurnFusion, turned_more

_EXTRAPOLATION = Extrapolation(100_000_000, speed_over=0, widest_gap=STALE_AFTER)
"""Odometry is extrapolated at the speed between its last two samples while the next is on its way. Chosen by
judgement: a few periods of typical odometry (50 Hz)."""
_GAP_SECONDS = 2.0
"""Seconds between two scans above which the car is searched for, because it may have been carried anywhere.
Chosen by judgement."""
_LONGEST_CARRY = 0.5
"""Seconds for which the speed of the estimates is held without odometry. Chosen by judgement: a car can stop
within half a second."""
_SPEED_SECONDS = 0.15
"""Seconds to average the estimates' speed. Chosen by judgement: some scans of a common sensor (40 Hz)."""


class MotionSource:
    """Turns samples into motion steps; none is counted twice or lost.

    Belongs to the thread that processes the scan, except for `step_from`, which any thread may call.
    """

    def __init__(self, config: LocalizationConfig) -> None:
        self.samples, self.config = MotionSamples(extrapolation=_EXTRAPOLATION), config
        self.calibration = OdometryCalibration()
        """Odometry calibration, applied to all steps."""
        self.turns = TurnFusion()
        """How reliable the turns from wheels and gyroscope have proven to be."""
        self.speed: Pose = IDENTITY
        """(3,) speed of the estimates, metres and radians per second."""
        self.reading = OdometryReading(0, 0, None, None)
        """The reading at the stamp of the last step."""
        self._motion: MeasuredMotion | None = None
        """The motion of the last step."""
        self._memory = SpeedMemory()
        self._laser_turn = 0.0
        """Rotation applied to the laser in the scan of the last step."""

    def step_to(self, stamp: int) -> MotionStep:
        """The motion since the last call."""
        before, self.reading = self.reading, self.samples.reading_at(stamp)
        if self._motion is None:
            motion = MeasuredMotion(0.0)
        elif is_set_back(before.stamp, stamp):
            motion = MeasuredMotion(inf)
        else:
            motion = before.motion_to(self.reading)
        self._motion, wheels = motion, motion.by_wheels
        step = self._carried_on(motion) if wheels is None else self._measured(wheels, motion)
        return self._with_laser_turned(step)

    def step_from(self, reading: OdometryReading, faults: OdometryFaults, stamp: int) -> MotionStep:
        """The motion from a reading to a stamp, by odometry with the given faults.

        The result is not stored, so any thread may ask for the motion up to now.
        """
        motion = reading.motion_to(self.samples.reading_at(stamp))
        if motion.by_wheels is None:
            return self._carried_on(motion)
        step = faults.corrected(motion.by_wheels)
        step = self.turns.model.fused(step, motion.by_gyro, motion.seconds)
        return MotionStep(step, odometry_deviations(step, self.config), travel(step), motion.seconds)

    def poses_in_sweep(self, stamps: NDArray[np.int64]) -> Pose:
        """Poses (N, 3) of the base at stamps (N,) during the sweep of the last step, in a fixed frame.

        From odometry, or without it from the speed of the estimates; turns from the gyroscope.
        """
        model, reading = self.turns.model, self.reading
        seconds = (stamps - reading.stamp) * 1e-9
        turns = self.samples.gyro_turns(reading.by_gyro, stamps)
        if reading.odom_from_base is None:
            return self._at_speed(seconds, turns)
        poses = self.samples.poses_at(stamps)
        if not model.is_used:
            return poses
        return model.fused(between(reading.odom_from_base, poses), turns, np.abs(seconds))

    def learn(self, moved: Pose, is_known: bool) -> None:
        """Learn from the estimates' motion (3,) in the last step, and whether their poses are known."""
        motion = self._motion
        if motion is None:
            return
        if is_known:
            wheels = motion.by_wheels
            corrected = None if wheels is None else self.calibration.faults.corrected(wheels)
            self.turns.follow(motion.seconds, float(moved[2]), motion.by_gyro, corrected)
        else:
            self.turns.start_anew()
        if 0.0 < motion.seconds < _LONGEST_CARRY:
            self.samples.frozen.follow(self.reading.stamp, moved)
            self.speed = smoothed_speed(self.speed, moved / motion.seconds, motion.seconds)

    def start_anew(self) -> None:
        """Restart: the next estimates do not continue the previous ones."""
        self.speed = IDENTITY
        self.turns.start_anew()

    def _measured(self, wheels: Pose, motion: MeasuredMotion) -> MotionStep:
        seconds = motion.seconds
        self.turns.watch(wheels, motion.by_gyro, seconds)
        by_wheels = self.calibration.faults.corrected(wheels)
        model = self.turns.model
        step = model.fused(by_wheels, motion.by_gyro, seconds)
        possible, effort, behind = self._memory.take(step, seconds)
        if model.is_used and not isnan(motion.by_gyro):  # it reports no turn too early
            turn = model.by_gyro(motion.by_gyro, seconds)
            behind = behind * np.array([1.0, 1.0, float(model.wheel_share(by_wheels, turn, seconds))])
        sliding = self.config.slip * (possible - np.abs(step))
        deviations = np.hypot(odometry_deviations(possible, self.config), sliding)
        is_over_gap = seconds > _GAP_SECONDS
        return MotionStep(step, deviations, travel(possible), seconds, effort, behind, is_over_gap)

    def _carried_on(self, motion: MeasuredMotion) -> MotionStep:
        model, seconds = self.turns.model, motion.seconds
        step = self._at_speed(seconds, motion.by_gyro)
        noise = drift_deviations(min(abs(seconds), _GAP_SECONDS), self.config)
        if model.is_used and not isnan(motion.by_gyro):
            noise[2] = sqrt(model.variance_by_gyro(float(step[2]), abs(seconds)))
        return MotionStep(step, noise, inf, seconds, is_over_gap=seconds > _GAP_SECONDS)

    def _at_speed(self, seconds: ArrayLike, gyro_turns: ArrayLike) -> Pose:
        """Steps (..., 3) over seconds (...) at the speed of the estimates, with turns (...) as measured by
        the gyroscope, NaN if missing."""
        steps: Pose = np.multiply.outer(np.clip(seconds, -_LONGEST_CARRY, _LONGEST_CARRY), self.speed)
        if not self.turns.model.is_used:
            return steps
        more = self.turns.model.by_gyro(np.asarray(gyro_turns), np.asarray(seconds)) - steps[..., 2]
        return turned_more(steps, np.where(np.isnan(more), 0.0, more))

    def _with_laser_turned(self, step: MotionStep) -> MotionStep:
        """The step to the base's pose, which depends on the laser's rotation as known by now."""
        turn, self._laser_turn = self._laser_turn - self.calibration.laser_turn, self.calibration.laser_turn
        if turn == 0.0:
            return step
        return replace(step, base_from_next_base=turned_more(step.base_from_next_base, turn))


def smoothed_speed(speed: Pose, measured: Pose, seconds: float) -> Pose:
    """A speed (3,) low-pass filtered with one (3,) measured over some seconds, since estimates scatter."""
    return speed + seconds / (seconds + _SPEED_SECONDS) * (measured - speed)
