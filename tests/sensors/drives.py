"""Drives with odometry and scans: a car round an oval in a small room, whose truth is known, and a robot that
winds through a furnished one, whose sweeps are taken beam after beam."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, interpolate
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.sensors.motion.odometry_buffer import Extrapolation
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.worlds import MAX_RANGE, ROOM
from tests.sensors.worlds import ranges as ranges_to

SCAN_PERIOD, ODOMETRY_PERIOD, SWEEP = 50_000_000, 20_000_000, 18_000_000
BASE_FROM_LASER = np.array([0.25, 0.0, 0.0])
BEARINGS = np.linspace(-2.35, 2.35, 271)
GO_ON = Extrapolation(longest=100_000_000, speed_over=0, widest_gap=500_000_000)
"""As the localizer takes the car to go on past its last odometry."""


@dataclass(frozen=True, eq=False)
class Drive:
    messages: list[Scan | Odometry]
    truth: Pose
    """(scans, 3) map_from_base at the stamp of each scan."""


def room() -> OccupancyGrid:
    """12 x 8 m, no two corners alike; the map frame is turned against the grid."""
    cells = np.full((160, 240), FREE, dtype=np.int8)
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[4:30, 4:20] = OCCUPIED
    cells[130:, 200:] = OCCUPIED
    cells[70:90, 100:125] = OCCUPIED
    cells[4:14, 150:158] = OCCUPIED
    cells[140:, 60:64] = OCCUPIED
    return OccupancyGrid(cells, 0.05, np.array([3.0, -2.0, 2.0]))


def pose_at(grid: OccupancyGrid, seconds: NDArray[np.float64], speed: float) -> Pose:
    """(N, 3) ``map_from_base`` on an oval about the middle of the room."""
    phase = speed * np.maximum(seconds, 0.0) / 2.6
    x, y = 6.0 + 3.3 * np.cos(phase), 4.0 + 1.9 * np.sin(phase)
    yaw = np.arctan2(1.9 * np.cos(phase), -3.3 * np.sin(phase))
    return compose(grid.map_from_grid, np.column_stack([x, y, yaw]))


def drive(
    grid: OccupancyGrid,
    seconds: float,
    rng: np.random.Generator,
    *,
    speed: float = 1.5,
    range_noise: float = 0.01,
    odometry_scale: float = 1.03,
    bearings: NDArray[np.float64] = BEARINGS,
) -> Drive:
    """Messages in the order of time; the odometry is off by a factor, besides noise."""
    messages: list[Scan | Odometry] = []
    odometry_stamps = np.arange(0, int(seconds * 1e9) + SCAN_PERIOD, ODOMETRY_PERIOD)
    true_steps = between(
        *(pose_at(grid, part * 1e-9, speed) for part in (odometry_stamps[:-1], odometry_stamps[1:]))
    )
    odom_from_base = IDENTITY
    messages.append(Odometry(0, odom_from_base, IDENTITY))
    for stamp, step in zip(odometry_stamps[1:].tolist(), true_steps, strict=True):
        noisy = odometry_scale * step + 0.05 * np.abs(step).sum() * rng.standard_normal(3)
        odom_from_base = compose(odom_from_base, noisy)
        messages.append(Odometry(stamp, odom_from_base, IDENTITY))
    stamps = np.arange(SCAN_PERIOD, int(seconds * 1e9), SCAN_PERIOD)
    messages.extend(sweep(grid, int(stamp), rng, speed, range_noise, bearings) for stamp in stamps)
    messages.sort(key=lambda message: message.stamp + (SCAN_PERIOD // 2 if isinstance(message, Scan) else 0))
    return Drive(messages, pose_at(grid, stamps * 1e-9, speed))


def sweep(
    grid: OccupancyGrid,
    stamp: int,
    rng: np.random.Generator,
    speed: float,
    range_noise: float,
    bearings: NDArray[np.float64],
) -> Scan:
    """A scan taken on the move."""
    offsets = np.linspace(0.0, SWEEP * 1e-9, len(bearings))
    map_from_laser = compose(pose_at(grid, stamp * 1e-9 + offsets, speed), BASE_FROM_LASER)
    ranges = cast_rays(grid, map_from_laser, bearings, 30.0) + range_noise * rng.standard_normal(
        len(bearings)
    )
    return Scan(stamp, bearings, ranges, offsets, BASE_FROM_LASER, 30.0)


STEP = 0.01
"""Seconds between the poses of a drive."""


@dataclass(frozen=True, eq=False)
class Laser:
    beams: int = 240
    rate: float = 8.0
    sweep: float = 0.12
    """Seconds; in the order of the bearings."""
    noise: float = 0.005


def winding_drive(seconds: float, turn_rate: float = 1.2, speed: float = 0.5) -> Pose:
    """(N, 3) poses every `STEP`, forwards and backwards, turning left and right."""
    times = np.arange(0.0, seconds + 2.0, STEP)
    rate = 0.7 * np.sin(0.9 * times) + 0.5 * np.sin(2.3 * times + 1.0) + 0.3  # which never repeats
    yaw = np.cumsum(turn_rate * rate) * STEP
    forward = speed * np.sign(np.sin(0.35 * times)) * STEP
    return np.column_stack([np.cumsum(forward * np.cos(yaw)), np.cumsum(forward * np.sin(yaw)), yaw])


def straight_drive(seconds: float) -> Pose:
    """(N, 3) to and fro along a line."""
    times = np.arange(0.0, seconds + 2.0, STEP)
    return np.column_stack([2.0 * np.sin(0.3 * times), 0.0 * times, 0.0 * times])


USUAL = Laser()


def scans_of(drive: Pose, seconds: float, laser: Laser = USUAL, walls: np.ndarray = ROOM) -> list[Scan]:
    """Sweeps with the beams' times as they are; stamps begin at 0."""
    rng = np.random.default_rng(1)
    bearings = np.linspace(-np.pi, np.pi, laser.beams, endpoint=False)
    offsets = np.linspace(0.0, laser.sweep, laser.beams)
    scans = []
    for begin in np.arange(0.0, seconds, 1.0 / laser.rate):
        poses = poses_at(drive, begin + offsets)
        seen = ranges_to(walls, poses, bearings) + laser.noise * rng.standard_normal(laser.beams)
        scans.append(Scan(round(begin * 1e9), bearings, seen, offsets, IDENTITY, MAX_RANGE))
    return scans


def odometry_of(drive: Pose, seconds: float, lag: float = 0.0) -> list[Odometry]:
    """50 samples a second, stamped ``lag`` seconds late."""
    times = np.arange(0.0, seconds, 0.02)
    return [
        Odometry(round((time + lag) * 1e9), pose, IDENTITY)
        for time, pose in zip(times, poses_at(drive, times), strict=True)
    ]


def poses_at(drive: Pose, times: np.ndarray) -> Pose:
    index = np.minimum((times / STEP).astype(int), len(drive) - 2)
    return interpolate(drive[index], drive[index + 1], times / STEP - index)
