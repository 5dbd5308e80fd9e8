"""A car that is carried elsewhere, visible only in its scans."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry

BETWEEN_SCANS = 5_000_000
"""Nanoseconds between the last message of a drive and the first of the next: less than a scan's period, so
that no gap reveals the kidnapping."""


def join_as_kidnappings(
    drives: Sequence[SimulatedDrive], pause: int = BETWEEN_SCANS
) -> tuple[SimulatedDrive, NDArray[np.int64]]:
    """Joins drives through one world into a single drive; also returns the scans at which the car is suddenly
    elsewhere.

    There are no messages for a ``pause`` (nanoseconds) between two drives. By default that is no gap, and the
    odometry continues where it was: only the scans show the kidnapping.
    """
    messages: list[Measurement] = []
    stamps: list[NDArray[np.int64]] = []
    end, odom_from_base = 0, np.zeros(3)
    for drive in drives:
        shift = end - drive.messages[0].stamp
        first = next(message for message in drive.messages if isinstance(message, Odometry))
        for message in drive.messages:
            if isinstance(message, Odometry):
                pose = compose(odom_from_base, between(first.odom_from_base, message.odom_from_base))
                messages.append(replace(message, stamp=message.stamp + shift, odom_from_base=pose))
            else:
                messages.append(replace(message, stamp=message.stamp + shift))
        stamps.append(drive.truth.stamps + shift)
        last = [message for message in messages if isinstance(message, Odometry)][-1]
        odom_from_base = last.odom_from_base
        end = max(messages[-1].stamp, last.stamp) + pause
    lengths = np.cumsum([len(drive.truth) for drive in drives])
    poses = np.concatenate([drive.truth.map_from_base for drive in drives])
    whole = SimulatedDrive(drives[0].grid, messages, Trajectory(np.concatenate(stamps), poses))
    return whole, lengths[:-1]
