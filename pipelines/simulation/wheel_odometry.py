"""Wheel odometry of a simulated drive: the true motion with measurement errors."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, between, chained
from racecar.pipelines.simulation.car import MAX_ACCELERATION, MAX_SIDE_ACCELERATION, WHEELBASE
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from racecar.sensors.odometry import Odometry

PERIOD_TICKS = 4
"""Ticks per message, which gives 50 messages a second."""
CARRY_PERIOD = 30.0
"""Seconds between the ends of successive periods in which the car is carried."""


@dataclass(frozen=True)
class OdometryNoise:
    """Errors of wheel odometry. Scales and bias are drawn once per drive, the rest grows with distance."""

    path_scale: float = 0.0
    """Standard deviation of the scale error of distances."""
    turn_scale: float = 0.0
    """The same for rotations."""
    turn_per_metre: float = 0.0
    """Standard deviation of a constant turn, radians per metre."""
    path_walk: float = 0.0
    """Metres per square root of a metre."""
    turn_walk: float = 0.0
    """Radians per square root of a metre."""
    slip: float = 0.0
    """Share by which wheels overrun at full acceleration and turns are overestimated at the tyres' limit."""


NOISE = {
    NoiseLevel.NONE: OdometryNoise(),
    NoiseLevel.SLIGHT: OdometryNoise(0.01, 0.01, 0.0005, 0.003, 0.003, 0.0),
    NoiseLevel.FULL: OdometryNoise(0.04, 0.05, 0.02, 0.01, 0.015, 0.1),
}
"""Chosen by judgement: a well calibrated car errs by a per cent, one with uncalibrated gains by some per
cent; the recordings of the race car show 4 % of distance."""

_STEERING_OFFSET, _STEERING_SCALE = np.radians(0.5), 0.06
"""Maximum errors of the steering angle, in radians and as a share; the minima are half of them. Chosen by
judgement, as for a servo whose gain and centre were set by eye. Half a degree makes 1.5° per metre."""


class Wheels:
    """The wheels of one drive, with constant scales and bias."""

    def __init__(self, level: NoiseLevel, generator: np.random.Generator) -> None:
        self._noise, self._generator = NOISE[level], generator
        self._path_scale = 1.0 + self._noise.path_scale * generator.standard_normal()
        self._turn_scale = 1.0 + self._noise.turn_scale * generator.standard_normal()
        self._bias = self._noise.turn_per_metre * generator.standard_normal()

    def measure(
        self, steps: Pose, effort: NDArray[np.float64], slip: float, *, by_steering: bool = False
    ) -> Pose:
        """(N, 3) motions measured by the wheels, from true motions (N, 3) with efforts (N, 2); ``slip`` is
        added to that of the noise level."""
        noise, generator = self._noise, self._generator
        factors = 1.0 + (noise.slip + slip) * effort
        distance = np.linalg.norm(steps[:, :2], axis=1)
        walk = np.sqrt(distance)[:, None] * generator.standard_normal((len(steps), 2))
        if by_steering:
            steps = _steered(steps, generator)
        path_factor, turn_factor = self._path_scale * factors[:, 0], self._turn_scale * factors[:, 1]
        return np.column_stack(
            [
                steps[:, 0] * path_factor + noise.path_walk * walk[:, 0],
                steps[:, 1] * path_factor,
                steps[:, 2] * turn_factor + self._bias * distance + noise.turn_walk * walk[:, 1],
            ]
        )


def efforts(speed: NDArray[np.float64], turning_speed: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) shares, -1 to 1, of full acceleration and of the tyres' lateral limit, which cause slip, in each
    period between speeds (N + 1,); braking is negative."""
    acceleration = np.diff(np.abs(speed)) / (PERIOD_TICKS * TICK)
    aside = np.abs(speed * turning_speed)[1:]
    effort = np.column_stack([acceleration / MAX_ACCELERATION, aside / MAX_SIDE_ACCELERATION])
    return np.clip(effort, -1.0, 1.0)


def measure_odometry(
    drive: CarMotion,
    start_ns: int,
    level: NoiseLevel,
    slip: float,
    generator: np.random.Generator,
    *,
    by_steering: bool = False,
    carried: float = 0.0,
) -> list[Odometry]:
    """Odometry every 20 ms from the first pose on, in a frame that starts at the car.

    ``slip`` is added to that of the level. Turns are optionally measured ``by_steering`` angle, and nothing
    is measured in the last ``carried`` seconds of each 30.
    """
    wheels = Wheels(level, generator)
    speed, turning_speed = drive.speed[::PERIOD_TICKS], drive.turning_speed[::PERIOD_TICKS]
    measured = wheels.measure(
        _true_steps(drive), efforts(speed, turning_speed), slip, by_steering=by_steering
    )
    period = PERIOD_TICKS * TICK
    measured[is_carried(period * np.arange(len(measured)), carried)] = 0.0
    stamps = start_ns + np.arange(len(measured) + 1) * round(period * 1e9)
    twists = np.concatenate([[[0.0, 0.0, 0.0]], measured / period])
    return [
        Odometry(stamp, pose, twist)
        for stamp, pose, twist in zip(stamps.tolist(), chained(measured), twists, strict=True)
    ]


def true_odometry(drive: CarMotion, start_ns: int) -> Iterator[Odometry]:
    """True ``map_from_base`` and twist, every 20 ms."""
    for tick in range(0, len(drive.speed), PERIOD_TICKS):
        twist = np.array([drive.speed[tick], 0.0, drive.turning_speed[tick]])
        yield Odometry(start_ns + round(tick * TICK * 1e9), drive.map_from_base[tick], twist)


def _true_steps(drive: CarMotion) -> Pose:
    """(N, 3) motion in each period, relative to its start."""
    poses = drive.map_from_base[::PERIOD_TICKS]
    return between(poses[:-1], poses[1:])


def _steered(steps: Pose, generator: np.random.Generator) -> Pose:
    """Steps (N, 3) whose turns follow from distance and commanded steering angle, with its errors."""
    distance = steps[:, 0]
    is_moving = np.abs(distance) > 1e-6
    curvature = np.where(is_moving, steps[:, 2], 0.0) / np.where(is_moving, distance, 1.0)
    wrong = generator.choice([-1.0, 1.0], 2) * generator.uniform(0.5, 1.0, 2)
    angle = (1.0 + _STEERING_SCALE * wrong[0]) * np.arctan(WHEELBASE * curvature) + _STEERING_OFFSET * wrong[
        1
    ]
    return np.column_stack([steps[:, :2], distance * np.tan(angle) / WHEELBASE])


def is_carried(seconds: ArrayLike, carried: float) -> NDArray[np.bool_]:
    """(N,) whether the car is carried at times (N,): in the last ``carried`` seconds of each 30."""
    return np.asarray(np.asarray(seconds) % CARRY_PERIOD >= CARRY_PERIOD - carried)
