"""The output of ``--record``: a run as a ROS 2 bag (MCAP) for RViz, Foxglove and ``racecar studio``."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.thinning import thinned
from racecar.maps.map_files import MOST_PIXELS
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.writer import BagWriter
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

RECORD_FOLDER = "record"
"""Folder in a run's folder; it contains ``record.mcap``."""
MAP_TOPIC, SCAN_TOPIC, ODOM_TOPIC = "/map", "/scan", "/odom"
POSE_TOPIC, PARTICLES_TOPIC, PATH_TOPIC = "/pf/pose/odom", "/pf/viz/particles", "/path"
"""The topics of the course's particle filter, so that its RViz settings work for a recording too."""

_PARTICLES_PERIOD = 100_000_000
"""Nanoseconds; ten particle clouds per second are enough to look at."""
_SHOWN_PARTICLES = 300
_GROWN = 1.1
"""A path is written again once it is a tenth longer, so the total size is proportional to the drive."""
_MOST_BEAMS = 8192


@contextmanager
def recording(folder: Path, grid: OccupancyGrid) -> Iterator["Recorder"]:
    """Yield a recorder for a running run. The bag appears complete, or not at all.

    Raises UserError when the folder cannot be written to.
    """
    with BagWriter(folder / RECORD_FOLDER) as writer:
        recorder = Recorder(writer, grid)
        yield recorder
        recorder.write_whole_path()


class Recorder:
    """Writes the inputs and outputs of a run, with its map."""

    def __init__(self, writer: BagWriter, grid: OccupancyGrid) -> None:
        self._writer = writer
        self._grid = grid
        self._has_begun = False
        self._last_particles = -_PARTICLES_PERIOD
        self._stamps: list[int] = []
        self._poses: list[Pose] = []
        self._written = 0

    def write_odometry(self, odometry: Odometry) -> None:
        """Write a sample of wheel odometry."""
        self._writer.write_odometry(odometry, ODOM_TOPIC)

    def write_scan(
        self, scan: Scan, map_from_base: Pose, covariance: NDArray[np.float64] | None = None
    ) -> None:
        """Write a scan and its pose (3,), if known; the first call also writes the map."""
        if self._stamps and scan.stamp <= self._stamps[-1]:
            return
        if not self._has_begun:
            self._has_begun = True
            self._writer.write_static_transform(scan.base_from_laser)
            self._writer.write_map(scan.stamp, self._grid, MAP_TOPIC)
        self._write_ranges(scan)
        pose = Odometry(scan.stamp, map_from_base, IDENTITY)
        self._writer.write_odometry(pose, POSE_TOPIC, "map", "base_link", covariance)
        self._writer.write_transform(scan.stamp, "map", "base_link", map_from_base)
        self._stamps.append(scan.stamp)
        self._poses.append(map_from_base)
        if len(self._stamps) >= _GROWN * self._written:
            self.write_whole_path()

    def write_particles(self, stamp: int, map_from_base: Pose, weights: NDArray[np.float64]) -> None:
        """Write a few hundred of the particles (N, 3), chosen by weight (N,), several times per second."""
        if stamp - self._last_particles < _PARTICLES_PERIOD:
            return
        self._last_particles = stamp
        self._writer.write_poses(stamp, map_from_base[_stand_ins(weights)], PARTICLES_TOPIC)

    def write_whole_path(self) -> None:
        """Write the path so far, unless that was already done."""
        if len(self._stamps) == self._written:
            return
        self._written = len(self._stamps)
        self._writer.write_path(self._stamps, np.array(self._poses), PATH_TOPIC)

    def _write_ranges(self, scan: Scan) -> None:
        angle_min, increment, ranges = as_even_beams(scan)
        sweep = float(np.ptp(scan.time_offsets)) if len(ranges) > 1 else 0.0
        self._writer.write_scan(
            scan.stamp,
            ranges,
            angle_min,
            increment,
            sweep / max(len(ranges) - 1, 1),
            sweep,
            0.0,
            scan.max_range,
            SCAN_TOPIC,
        )


def record_mapping(reader: BagReader, result: MappingResult, folder: Path) -> None:
    """Read a bag once more and write its scans at their poses in the finished map.

    Only the finished map has the final poses: loop closures move those of earlier scans.
    """
    trajectory = result.trajectory
    poses = dict(zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True))
    with recording(folder, thinned(result.tiled, MOST_PIXELS)) as recorder:
        for message in reader:
            if isinstance(message, Odometry):
                recorder.write_odometry(message)
            elif isinstance(message, Scan) and message.stamp in poses:
                recorder.write_scan(message, poses[message.stamp])
            elif message.stamp > trajectory.stamps[-1]:
                break  # Ctrl-C ended the mapping here


def as_even_beams(scan: Scan) -> tuple[float, float, NDArray[np.float32]]:
    """First bearing, increment (rad) and ranges (N,) on even bearings, as LaserScan requires.

    Even beams are unchanged. Otherwise each beam is moved to the nearest bearing; of two beams the nearer
    range counts, and a bearing without a beam is nan.
    """
    bearings, ranges = scan.bearings, scan.ranges
    if len(bearings) < 2:
        return float(bearings[0]) if len(bearings) else 0.0, 1.0, ranges.astype(np.float32)
    steps = np.diff(bearings)
    increment = float(np.ptp(bearings) / (len(bearings) - 1))
    if np.ptp(steps) > 0.1 * increment:
        increment = max(float(np.median(steps)), float(np.ptp(bearings)) / _MOST_BEAMS)
    places = np.rint((bearings - bearings[0]) / increment).astype(np.int64)
    even = np.full(places[-1] + 1, np.nan)
    np.fmin.at(even, places, ranges)
    return float(bearings[0]), increment, even.astype(np.float32)


def _stand_ins(weights: NDArray[np.float64]) -> NDArray[np.int64]:
    """Deterministic indices of representative particles, evenly spaced by weight."""
    count = min(_SHOWN_PARTICLES, len(weights))
    shares = np.cumsum(weights) / weights.sum()
    chosen = np.searchsorted(shares, (np.arange(count) + 0.5) / count)
    return np.minimum(chosen, len(weights) - 1).astype(np.int64)
