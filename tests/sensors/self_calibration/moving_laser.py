"""A robot that drives through a furnished room: sweeps, taken beam after beam, and its odometry."""

from dataclasses import dataclass

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose, interpolate
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.worlds import MAX_RANGE, ROOM

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
        ranges = ranges_of_beams(walls, poses, bearings) + laser.noise * rng.standard_normal(laser.beams)
        scans.append(Scan(round(begin * 1e9), bearings, ranges, offsets, IDENTITY, MAX_RANGE))
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


def ranges_of_beams(walls: np.ndarray, poses: Pose, bearings: np.ndarray) -> np.ndarray:
    """(N,) metres along one bearing each (N,) from one pose each (N, 3)."""
    direction = np.stack([np.cos(poses[:, 2] + bearings), np.sin(poses[:, 2] + bearings)], axis=1)[:, None]
    start, along = walls[None, :, 0] - poses[:, None, :2], (walls[:, 1] - walls[:, 0])[None]

    def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    with np.errstate(divide="ignore", invalid="ignore"):
        facing = cross(direction, along)
        distance, share = cross(start, along) / facing, cross(start, direction) / facing
        meets = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(meets, distance, np.inf).min(axis=1)
