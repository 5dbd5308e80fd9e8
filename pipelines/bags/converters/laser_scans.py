"""Conversion of LaserScan messages, as real drivers send them, to scans."""

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import wrap_angle
from racecar.pipelines.bags.converters.scan_reading import WIDEST, ScanSetup, limits
from racecar.sensors.scan import LONGEST_RANGE, Scan, frozen

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__LaserScan

RANGE_LIMIT = 60.0
"""Metres from which readings count as misses if the message does not state the sensor's range. Few planar
scanners see farther."""


@dataclass(frozen=True, eq=False)
class _Layout:
    """What stays the same between sweeps: the bearing and time of each beam."""

    key: tuple[float, float, float, float, int]
    bearings: NDArray[np.float64]
    time_offsets: NDArray[np.float64]
    span: float
    """Radians from first to last beam."""
    order: NDArray[np.intp] | None
    """Message beams sorted by bearing; None if they already are."""


class LaserScanConverter:
    """Converts messages to scans and counts what it corrects."""

    def __init__(self, setup: ScanSetup, counts: Counter[str]) -> None:
        self._setup, self._reading, self._counts = setup, setup.reading, counts
        self._place = setup.place.pose
        self._layout: _Layout | None = None

    def convert(self, message: "sensor_msgs__msg__LaserScan", stamp: int) -> Scan | None:
        """The scan; None if the message has no usable beams."""
        layout = self._layout_of(message)
        if layout is None:
            self._counts["empty_scans"] += 1
            return None
        if layout.span > WIDEST:  # not a sweep: it is unknown which beams belong together
            self._counts["scans_beyond_one_turn"] += 1
            return None
        if not abs(message.time_increment) * (len(message.ranges) - 1) <= self._setup.longest_sweep:
            self._counts["time_increments_ignored"] += 1
        ranges, max_range = self._clean_ranges(message)
        if layout.order is not None:
            ranges = ranges[layout.order]
        return Scan(stamp, layout.bearings, ranges, layout.time_offsets, self._place, max_range)

    def _layout_of(self, message: "sensor_msgs__msg__LaserScan") -> _Layout | None:
        key = (
            message.angle_min,
            message.angle_max,
            message.angle_increment,
            message.time_increment,
            len(message.ranges),
        )
        if self._layout is None or self._layout.key != key:
            layout = self._new_layout(key)
            if layout is not None and self._layout is not None and self._layout.key[4] != key[4]:
                self._counts["changed_beam_counts"] += 1
            if layout is None:
                return None
            self._layout = layout
        return self._layout

    def _new_layout(self, key: tuple[float, float, float, float, int]) -> _Layout | None:
        angle_min, angle_max, increment, time_increment, count = key
        if increment == 0 or not np.isfinite(increment):
            increment = (angle_max - angle_min) / max(count - 1, 1)
        angle_min, increment = self._reading.angles.first_and_increment(
            angle_min, angle_max, increment, count
        )
        if count < 2 or not np.isfinite(angle_min) or not 0 < abs(increment) < np.pi:
            return None
        bearings = angle_min + increment * np.arange(count)
        bearings = wrap_angle(-bearings if self._setup.place.is_upside_down else bearings)
        sweep = abs(time_increment) * (count - 1)
        if not sweep <= self._setup.longest_sweep:
            time_increment = 0.0
        time_offsets = time_increment * np.arange(count, dtype=np.float64)
        order = np.argsort(bearings, kind="stable")
        # A full circle may end at the bearing where it began.
        order = order[np.diff(bearings[order], prepend=-np.inf) > 1e-9]
        span = abs(increment) * (count - 1)
        if np.array_equal(order, np.arange(count)):
            return _Layout(key, frozen(bearings), frozen(time_offsets), span, None)
        return _Layout(key, frozen(bearings[order]), frozen(time_offsets[order]), span, order)

    def _clean_ranges(self, message: "sensor_msgs__msg__LaserScan") -> tuple[NDArray[np.float64], float]:
        """Ranges with misses as inf and invalid readings as nan, and the range where misses begin."""
        min_range, max_range = limits(message, self._reading.unit)
        config = self._setup.config
        if config.max_range is not None:
            max_range = config.max_range
        elif not 0 < max_range < LONGEST_RANGE:
            max_range = RANGE_LIMIT
            self._counts["scans_without_range_max"] += 1
        max_range = min(max_range, self._reading.nearest_miss)
        if config.min_range is not None:
            min_range = config.min_range
        elif not 0 < min_range < max_range:
            min_range = 1e-6
        with np.errstate(invalid="ignore"):  # damaged bytes may contain signalling NaN
            ranges = np.array(message.ranges, dtype=np.float64)
        if self._reading.unit != 1.0:
            ranges *= self._reading.unit
        is_miss = ranges >= max_range
        is_valid = ranges >= min_range
        self._counts["beams"] += len(ranges)
        self._counts["beams_missed"] += int(np.count_nonzero(is_miss))
        if not is_valid.all():
            is_nan, is_zero = np.isnan(ranges), ranges == 0
            invalid = len(ranges) - int(np.count_nonzero(is_valid))
            nan, zero = int(np.count_nonzero(is_nan)), int(np.count_nonzero(is_zero))
            self._counts["beams_nan"] += nan
            self._counts["beams_zero"] += zero
            self._counts["beams_below_range_min"] += invalid - nan - zero
            ranges[~is_valid] = np.nan
        ranges[is_miss] = np.inf
        return ranges, max_range
