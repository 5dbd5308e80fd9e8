"""Positions and times of the points in a PointCloud2 message."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.bags.messages import nanoseconds

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import (
        sensor_msgs__msg__PointCloud2,
        sensor_msgs__msg__PointField,
    )

_COORDINATES = {7: "f4", 8: "f8"}
_TIMES = {5: "i4", 6: "u4", **_COORDINATES}
_TIME_FIELDS = ("t", "time", "timestamp", "time_stamp", "offset_time")  # Ouster, Velodyne, Hesai, ..., Livox
_SINCE_1970 = 1e8  # seconds; a larger value is a time of day, not an offset
_SINCE_1970_IN_NANOSECONDS = 1e17
_FARTHEST = 1.0  # seconds between a cloud's stamp and its points


def positions(message: "sensor_msgs__msg__PointCloud2") -> NDArray[np.float64] | None:
    """(N, 3) metres in the message's frame; None if it does not hold what it announces.

    Points without a height are at height zero.
    """
    names = [name for name in ("x", "y", "z") if name != "z" or _field(message, name) is not None]
    columns = [_column(message, name, _COORDINATES) for name in names]
    if any(column is None for column in columns):
        return None
    # Not earlier, since a message may announce any number of points.
    points = np.zeros((message.height * message.width, 3))
    with np.errstate(invalid="ignore"):  # damaged bytes may contain signalling NaN
        for index, column in enumerate(columns):
            points[:, index] = column
    return points


def time_offsets(message: "sensor_msgs__msg__PointCloud2") -> NDArray[np.float64] | None:
    """(N,) seconds from the message's stamp to each point; None if the message has no times.

    Implausible times are nan. Integers are nanoseconds since the stamp.
    """
    columns = (_column(message, name, _TIMES) for name in _TIME_FIELDS)
    times = next((column for column in columns if column is not None), None)
    if times is None or len(times) == 0:
        return None
    with np.errstate(invalid="ignore"):  # damaged bytes may contain signalling NaN
        numbers = times.astype(np.float64)
    in_nanoseconds = times.dtype.kind in "iu" or numbers.max() > _SINCE_1970_IN_NANOSECONDS
    seconds = numbers * (1e-9 if in_nanoseconds else 1.0)
    if seconds.max() > _SINCE_1970:
        seconds -= nanoseconds(message.header.stamp) * 1e-9
    is_plausible = bool(np.all(np.abs(seconds) < _FARTHEST))
    return seconds if is_plausible else np.full(len(seconds), np.nan)


def _field(message: "sensor_msgs__msg__PointCloud2", name: str) -> "sensor_msgs__msg__PointField | None":
    return next((field for field in message.fields if field.name == name), None)


def _column(
    message: "sensor_msgs__msg__PointCloud2", name: str, formats: dict[int, str]
) -> NDArray[np.generic] | None:
    """(N,) one field of all points; None if the message lacks it or it has another type."""
    field, row = _field(message, name), message.width * message.point_step
    if field is None or field.datatype not in formats:
        return None
    kind = np.dtype((">" if message.is_bigendian else "<") + formats[field.datatype])
    is_cut = len(message.data) < message.height * message.row_step
    if is_cut or message.row_step < row or message.point_step < field.offset + kind.itemsize:
        return None
    if message.height * message.width == 0:
        return np.empty(0, kind)
    layout = np.dtype(
        {"names": [name], "formats": [kind], "offsets": [field.offset], "itemsize": message.point_step}
    )
    rows = np.asarray(message.data)[: message.height * message.row_step].reshape(message.height, -1)
    column: NDArray[np.generic] = np.ascontiguousarray(rows[:, :row]).view(layout)[name].ravel()
    return column
