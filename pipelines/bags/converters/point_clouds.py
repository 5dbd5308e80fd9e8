"""Conversion of PointCloud2 messages to scans: a planar section, and all points of a multi-row sensor."""

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import inverse, transform_points
from racecar.pipelines.bags.converters.point_fields import positions, time_offsets
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.sensors.cloud import Cloud
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__PointCloud2

_MIN_RANGE, _MAX_RANGE = 0.05, 100.0
"""Metres between which points count, since a cloud does not state its sensor's range. Nearer points are on
the sensor's own housing, and a missed beam reads as zero. Chosen by judgement."""
_FARTHEST = 1e5
"""Metres; larger coordinates come from damaged bytes, and their squares may overflow."""
_FLAT = 0.01
"""Metres of height within which a cloud is from a planar sensor; rounding alone spreads its points."""
_THICK = 0.1
"""Metres of deviation from the best plane; a tilted planar sensor shows less, since it sees one plane."""
_MOST_BEAMS = 2048
"""A planar scanner has fewer beams, so more points come from many rows."""
_BEARING_BUCKET = np.radians(0.25)
"""Beam spacing of a Hokuyo, so a section is as fine as a planar scan."""


class PointCloudConverter:
    """Converts clouds to scans; the points within a band of heights are the beams."""

    def __init__(self, setup: ScanSetup, counts: Counter[str]) -> None:
        """The cloud of a planar sensor is used whole."""
        place, self._config, self._counts = setup.place, setup.config, counts
        self._base_from_points = np.eye(4) if setup.points_are_in_base else place.base_from_sensor
        self._base_from_laser = place.pose
        self._laser_from_base = inverse(place.pose)
        self._min_range = self._config.min_range or _MIN_RANGE
        self._max_range = self._config.max_range or _MAX_RANGE
        self._has_many_rows: bool | None = None

    def convert(self, message: "sensor_msgs__msg__PointCloud2", stamp: int) -> Scan | None:
        """The scan; None if no point is usable. The first cloud decides whether the sensor has many rows."""
        points, offsets = self._finite_points(message)
        is_flat = len(points) > 0 and bool(np.ptp(points[:, 2]) < _FLAT)
        points = points @ self._base_from_points[:3, :3].T + self._base_from_points[:3, 3]
        points[:, :2] = transform_points(self._laser_from_base, points[:, :2])
        ranges, bearings = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        is_in_reach = (ranges >= self._min_range) & (ranges < self._max_range)
        heights = points[:, 2]
        is_in_band = (heights >= self._config.min_height) & (heights <= self._config.max_height)
        candidates = np.flatnonzero(is_in_reach & (is_in_band | is_flat))
        if self._has_many_rows is None and len(candidates):
            self._has_many_rows = _thickness(points[is_in_reach]) > _THICK
        beams = candidates[self._nearest_per_bearing(bearings[candidates], ranges[candidates])]
        if len(beams) < 2:
            self._counts["empty_scans"] += 1
            return None
        self._counts["beams"] += len(beams)
        return Scan(
            stamp,
            bearings[beams],
            ranges[beams],
            offsets[beams],
            self._base_from_laser,
            self._max_range,
            _cloud(points[is_in_reach], offsets[is_in_reach]) if self._has_many_rows else None,
        )

    def _finite_points(
        self, message: "sensor_msgs__msg__PointCloud2"
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) in the message's frame, and seconds (N,) from its stamp, zero without times."""
        points = positions(message)
        if points is None:
            return np.empty((0, 3)), np.empty(0)
        offsets = time_offsets(message)
        if offsets is None or np.isnan(offsets).any():
            self._counts["point_times_ignored"] += offsets is not None
            offsets = np.zeros(len(points))
        is_finite = (np.abs(points) < _FARTHEST).all(axis=1)
        self._counts["beams_nan"] += int(len(points) - np.count_nonzero(is_finite))
        return points[is_finite], offsets[is_finite]

    def _nearest_per_bearing(
        self, bearings: NDArray[np.float64], ranges: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """Indices of one beam per bearing, ascending; for a dense cloud, one per quarter of a degree."""
        is_dense = self._has_many_rows or len(bearings) > _MOST_BEAMS
        buckets = np.floor(bearings / _BEARING_BUCKET) if is_dense else bearings
        order = np.lexsort((ranges, buckets))
        return order[np.diff(buckets[order], prepend=-np.inf) > 0]


def _thickness(points: NDArray[np.float64]) -> float:
    """Standard deviation in metres of points (N, 3) from their best-fit plane."""
    if len(points) < 4:
        return 0.0
    return float(np.sqrt(max(np.linalg.eigvalsh(np.cov(points.T))[0], 0.0)))


def _cloud(points: NDArray[np.float64], offsets: NDArray[np.float64]) -> Cloud:
    return Cloud(points.astype(np.float32), offsets.astype(np.float32))
