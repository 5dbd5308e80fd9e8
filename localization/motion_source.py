"""The car's motion from one scan to the next: measured by odometry, or carried on where there is none."""

from dataclasses import dataclass

import numpy as np

from localization.config import LocalizationConfig
from localization.motion_model import drift_noise, odometry_noise, travel
from maps.odometry import Odometry, OdometryBuffer
from maps.se2 import IDENTITY, Pose, between

RESTART_SECONDS = 1.0
"""A clock that goes back by more has been set anew; by less, messages came out of order."""
GAP_SECONDS = 2.0
"""Between two scans; what happens in a longer one is a matter of searching rather than of noise."""
_STALE_SECONDS = 0.5
_FASTEST = 20.0
"""Metres or radians per second; odometry that claims more has jumped."""
_SLIDE_SECONDS = 0.2
"""How fast the noise of a motion dies away: with its wheels locked a car slides on."""
_STANDING = 0.01
"""Metres or radians per second below which a car stands."""
_LONGEST_CARRY = 0.5
"""Seconds for which a speed is believed to last."""
_SPEED_MEMORY = 0.15
"""Seconds over which the speed of the estimates is averaged."""


@dataclass(frozen=True, eq=False)
class MotionStep:
    """The motion between two scans."""

    base_from_next_base: Pose
    deviations: Pose
    """(3,) standard deviations in metres and radians."""
    travel: float
    """Metres plus radians that the car may have moved; inf where nothing measured it."""
    seconds: float
    """inf where the clock was set back, so that nothing tells."""

    @property
    def is_over_gap(self) -> bool:
        """Whether so much time has passed that the car may have been carried to anywhere."""
        return self.seconds > GAP_SECONDS


class MotionSource:
    """Gathers odometry, and tells the motion since the last scan; none of it is counted twice or lost."""

    def __init__(self, config: LocalizationConfig) -> None:
        self._config = config
        self._odometry = OdometryBuffer()
        self._odom_from_base: Pose | None = None
        self._stamp: int | None = None
        self._possible_speed: Pose = IDENTITY
        self._speed: Pose = IDENTITY
        self._last_estimate: tuple[int, Pose] | None = None

    def add(self, odometry: Odometry) -> None:
        """Take a sample; one that is not finite or comes out of order is left out."""
        if not np.all(np.isfinite(odometry.odom_from_base)):
            return
        latest = self._odometry.latest_stamp
        if latest is not None and latest - odometry.stamp > RESTART_SECONDS * 1e9:
            self._odometry = OdometryBuffer()
            self._odom_from_base = None
        self._odometry.add(odometry)

    def odometry_about(self, stamp: int) -> OdometryBuffer | None:
        """The odometry if it reaches to a stamp, or nearly."""
        latest = self._odometry.latest_stamp
        return self._odometry if latest is not None and stamp - latest < _STALE_SECONDS * 1e9 else None

    def step_to(self, stamp: int) -> MotionStep:
        """The motion since the last call."""
        if self._stamp is None:
            seconds = 0.0
        elif self._stamp - stamp > RESTART_SECONDS * 1e9:
            seconds = np.inf
            self._odom_from_base = None
        else:
            seconds = max(stamp - self._stamp, 0) * 1e-9
        self._stamp = stamp
        return self._measured(stamp, seconds) or self._carried_on(seconds)

    def follow(self, stamp: int, map_from_base: Pose) -> None:
        """Learn the car's speed from an estimate, for when odometry fails."""
        if self._last_estimate is not None:
            seconds = (stamp - self._last_estimate[0]) * 1e-9
            if 0.0 < seconds < _LONGEST_CARRY:
                speed = between(self._last_estimate[1], map_from_base) / seconds
                self._speed = self._speed + seconds / (seconds + _SPEED_MEMORY) * (speed - self._speed)
        self._last_estimate = (stamp, map_from_base)

    def forget_speed(self) -> None:
        """The estimates to come do not continue those before."""
        self._speed, self._last_estimate = IDENTITY, None

    def _measured(self, stamp: int, seconds: float) -> MotionStep | None:
        before, odometry = self._odom_from_base, self.odometry_about(stamp)
        self._odom_from_base = odometry.pose_at(stamp) if odometry is not None else None
        if before is None or self._odom_from_base is None:
            return None
        step = between(before, self._odom_from_base)
        if travel(step) > _FASTEST * (seconds + _STALE_SECONDS):
            return None
        possible = self._possible_step(step, seconds)
        noise = odometry_noise(possible, self._config.motion_noise, self._config.slip)
        return MotionStep(step, noise, travel(possible), seconds)

    def _possible_step(self, step: Pose, seconds: float) -> Pose:
        """(3,) how far the car may have gone in each coordinate: as measured, or on as a moment before."""
        if seconds == 0.0:
            return np.abs(step)
        sliding = self._possible_speed * np.exp(-seconds / _SLIDE_SECONDS)
        sliding[sliding < _STANDING] = 0.0
        self._possible_speed = np.maximum(np.abs(step) / seconds, sliding)
        return self._possible_speed * seconds

    def _carried_on(self, seconds: float) -> MotionStep:
        step = self._speed * min(seconds, _LONGEST_CARRY)
        noise = drift_noise(min(seconds, GAP_SECONDS), self._config.drift_noise)
        return MotionStep(step, noise, np.inf, seconds)
