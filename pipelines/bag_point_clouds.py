"""PointCloud2 messages to planar scans."""

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from maps.scan import Scan
from maps.se2 import inverse, transform_points
from pipelines.bag_transforms import SensorPlace

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__PointCloud2

MAX_RANGE = 100.0
"""Metres; a cloud does not tell the sensor's range, and what lies beyond is left out."""
_MIN_RANGE = 0.05
_FLAT = 0.01  # metres of height within which a cloud is that of a planar sensor
_MOST_BEAMS = 2048  # more than a planar sensor has: the cloud is that of a sensor with many rows
_BEARING_BUCKET = np.radians(0.25)
_FORMATS = {7: "f4", 8: "f8"}


class PointCloudConverter:
    """Makes planar scans of the points within a band of heights."""

    def __init__(
        self,
        points_place: NDArray[np.float64],
        place: SensorPlace,
        heights: tuple[float, float],
        counts: Counter[str],
    ) -> None:
        """``points_place`` is ``base_from_points`` (4, 4), ``place`` whence the points are looked at,
        ``heights`` lowest and highest in metres in the base frame; a planar sensor's cloud is taken whole."""
        self._base_from_points = points_place
        self._base_from_laser = place.pose
        self._laser_from_base = inverse(place.pose)
        self._min_height, self._max_height = heights
        self._counts = counts
        self._beam_count = 0

    def convert(self, message: "sensor_msgs__msg__PointCloud2", stamp: int) -> Scan | None:
        """The scan; None where no point is usable."""
        points = _points(message)
        bearings, ranges = self._beams(points) if points is not None else (np.empty(0), np.empty(0))
        if len(bearings) < 2:
            self._counts["empty_scans"] += 1
            return None
        self._counts["beams"] += len(bearings)
        offsets = np.zeros(len(bearings))
        return Scan(stamp, bearings, ranges, offsets, self._base_from_laser, MAX_RANGE)

    def _beams(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bearings, strictly ascending, and ranges seen from the sensor's place."""
        is_finite = np.isfinite(points).all(axis=1)
        self._counts["beams_nan"] += int(len(points) - np.count_nonzero(is_finite))
        points = points[is_finite]
        is_flat = len(points) > 0 and bool(np.ptp(points[:, 2]) < _FLAT)
        points = points @ self._base_from_points[:3, :3].T + self._base_from_points[:3, 3]
        if not is_flat:
            points = points[(points[:, 2] >= self._min_height) & (points[:, 2] <= self._max_height)]
        in_laser = transform_points(self._laser_from_base, points[:, :2])
        ranges = np.hypot(in_laser[:, 0], in_laser[:, 1])
        bearings = np.arctan2(in_laser[:, 1], in_laser[:, 0])
        keep = (ranges >= _MIN_RANGE) & (ranges < MAX_RANGE)
        return _nearest_per_bearing(bearings[keep], ranges[keep])


def _nearest_per_bearing(
    bearings: NDArray[np.float64], ranges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One beam per bearing; of a dense cloud one per quarter of a degree."""
    is_dense = len(bearings) > _MOST_BEAMS
    buckets = np.floor(bearings / _BEARING_BUCKET) if is_dense else bearings
    order = np.lexsort((ranges, buckets))
    order = order[np.diff(buckets[order], prepend=-np.inf) > 0]
    return bearings[order], ranges[order]


def _points(message: "sensor_msgs__msg__PointCloud2") -> NDArray[np.float64] | None:
    """(N, 3) in the frame of the message; None where it does not hold what it announces."""
    fields = {field.name: field for field in message.fields}
    names = [name for name in ("x", "y", "z") if name in fields]
    if names[:2] != ["x", "y"] or any(fields[name].datatype not in _FORMATS for name in names):
        return None
    row = message.width * message.point_step
    if len(message.data) < message.height * message.row_step or message.row_step < row:
        return None
    endian = ">" if message.is_bigendian else "<"
    layout = np.dtype(
        {
            "names": names,
            "formats": [endian + _FORMATS[fields[name].datatype] for name in names],
            "offsets": [fields[name].offset for name in names],
            "itemsize": message.point_step,
        }
    )
    rows = np.asarray(message.data)[: message.height * message.row_step].reshape(message.height, -1)
    table = np.ascontiguousarray(rows[:, :row]).view(layout).ravel()
    points = np.zeros((len(table), 3))
    for column, name in enumerate(names):
        points[:, column] = table[name]
    return points
