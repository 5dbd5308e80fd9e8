"""Wheel odometry of a simulated drive: the true motion, measured badly."""

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
"""50 messages a second."""
CARRY_PERIOD = 30.0
"""Seconds from the end of one time to the end of the next in which the car is carried."""


@dataclass(frozen=True)
class OdometryNoise:
    """How wheel odometry errs. Scales and bias are drawn once a drive, the rest grows with the distance."""

    path_scale: float = 0.0
    """Standard deviation of the share by which distances are wrong."""
    turn_scale: float = 0.0
    """The same for rotations."""
    turn_per_metre: float = 0.0
    """Standard deviation of a constant turn, radians per metre."""
    path_walk: float = 0.0
    """Metres per square root of a metre."""
    turn_walk: float = 0.0
    """Radians per square root of a metre."""
    slip: float = 0.0
    """Share by which wheels run ahead at full acceleration and turns are overstated at the tyres' limit."""


NOISE = {
    NoiseLevel.NONE: OdometryNoise(),
    NoiseLevel.SLIGHT: OdometryNoise(0.01, 0.01, 0.0005, 0.003, 0.003, 0.0),
    NoiseLevel.FULL: OdometryNoise(0.04, 0.05, 0.02, 0.01, 0.015, 0.1),
}
"""By judgement: a well calibrated car errs by a per cent, one whose gains nobody has set by some per cent;
the recordings of the race car show 4 % of distance."""

_STEERING_OFFSET, _STEERING_SCALE = np.radians(0.5), 0.06
"""Radians and a share by which the angle is off at most, at least by half of it: by judgement, as of a servo
whose gain and middle were set by eye. Half a degree makes 1.5° per metre."""


class Wheels:
    """The wheels of one drive, whose scales and bias stay as they are."""

    def __init__(self, level: NoiseLevel, generator: np.random.Generator) -> None:
        self._noise, self._generator = NOISE[level], generator
        self._path_scale = 1.0 + self._noise.path_scale * generator.standard_normal()
        self._turn_scale = 1.0 + self._noise.turn_scale * generator.standard_normal()
        self._bias = self._noise.turn_per_metre * generator.standard_normal()

    def measure(
        self, steps: Pose, effort: NDArray[np.float64], slip: float, *, by_steering: bool = False
    ) -> Pose:
        """(N, 3) what they report of true motions (N, 3), made with an effort (N, 2); they ``slip`` on top of
        what their level of noise brings."""
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
    """(N, 2) shares, -1 to 1, of full acceleration and of the tyres' limit to the side, by which wheels slip,
    in each period between speeds (N + 1,); braking is negative."""
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
    """Odometry every 20 ms from the first pose on, in a frame that starts where the car does.

    ``slip`` comes on top of the level's own. Turns are measured ``by_steering`` angle where asked for, and
    nothing in the last ``carried`` seconds of each 30.
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
    """``map_from_base`` and the twist as they are, every 20 ms."""
    for tick in range(0, len(drive.speed), PERIOD_TICKS):
        twist = np.array([drive.speed[tick], 0.0, drive.turning_speed[tick]])
        yield Odometry(start_ns + round(tick * TICK * 1e9), drive.map_from_base[tick], twist)


def _true_steps(drive: CarMotion) -> Pose:
    """(N, 3) each period's motion, seen from its beginning."""
    poses = drive.map_from_base[::PERIOD_TICKS]
    return between(poses[:-1], poses[1:])


def _steered(steps: Pose, generator: np.random.Generator) -> Pose:
    """Steps (N, 3) whose turns follow from distance and steering angle, as the servo is told it."""
    distance = steps[:, 0]
    is_moving = np.abs(distance) > 1e-6
    curvature = np.where(is_moving, steps[:, 2], 0.0) / np.where(is_moving, distance, 1.0)
    wrong = generator.choice([-1.0, 1.0], 2) * generator.uniform(0.5, 1.0, 2)
    angle = (1.0 + _STEERING_SCALE * wrong[0]) * np.arctan(WHEELBASE * curvature) + _STEERING_OFFSET * wrong[
        1
    ]
    return np.column_stack([steps[:, :2], distance * np.tan(angle) / WHEELBASE])


def is_carried(seconds: ArrayLike, carried: float) -> NDArray[np.bool_]:
    """(N,) whether at times (N,) of the drive: in the last ``carried`` seconds of each 30."""
    return np.asarray(np.asarray(seconds) % CARRY_PERIOD >= CARRY_PERIOD - carried)
