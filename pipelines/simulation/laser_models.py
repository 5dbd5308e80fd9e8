"""The available lasers of a simulated car."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.simulation.driver import TICK
from racecar.pipelines.simulation.simulator_config import LaserKind
from racecar.sensors.scan import Scan

BASE_FROM_LASER = np.array([0.27, 0.0, 0.0])
"""(3,) on the axis, above the front wheels."""


@dataclass(frozen=True)
class LaserModel:
    """Geometry and accuracy of a laser; its beams go counter-clockwise, at equal intervals."""

    beams: int
    field_of_view: float
    """Degrees from the first beam to the last."""
    scan_time: float
    """Seconds between sweeps, a multiple of ``TICK``."""
    sweep_share: float
    """Share of ``scan_time`` from the first beam to the last."""
    range_min: float
    range_max: float
    """Metres, both."""
    noise: float
    """Standard deviation of a range, metres."""
    dropouts: float
    """Share of beams without a return, whatever they meet."""
    height: float
    """Metres above the floor."""
    faint_range: float = np.inf
    """Metres at which half of the echoes are too faint; far nearer hardly any, far beyond nearly all."""

    @property
    def angle_min(self) -> float:
        """Radians, of the first beam."""
        return float(np.radians(-self.field_of_view / 2))

    @property
    def angle_increment(self) -> float:
        """Radians."""
        return float(np.radians(self.field_of_view)) / (self.beams - 1)

    @property
    def time_increment(self) -> float:
        """Seconds."""
        return self.scan_time * self.sweep_share / (self.beams - 1)

    @property
    def period_ticks(self) -> int:
        """Ticks from sweep to sweep."""
        return round(self.scan_time / TICK)

    @cached_property
    def bearings(self) -> NDArray[np.float64]:
        """(beams,) radians."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)

    @cached_property
    def time_offsets(self) -> NDArray[np.float64]:
        """(beams,) seconds after the first beam."""
        return self.time_increment * np.arange(self.beams, dtype=np.float64)

    def scan(self, stamp: int, ranges: NDArray[np.float32]) -> Scan:
        """A scan (beams,), inf for a miss, with the stamp of its first beam in nanoseconds."""
        return Scan(
            stamp=stamp,
            bearings=self.bearings,
            ranges=ranges.astype(np.float64),
            time_offsets=self.time_offsets,
            base_from_laser=BASE_FROM_LASER,
            max_range=self.range_max,
        )


UST_10LX = LaserModel(
    beams=1081,
    field_of_view=270.0,
    scan_time=0.025,
    sweep_share=0.75,
    range_min=0.06,
    range_max=30.0,
    noise=0.01,
    dropouts=0.002,
    height=0.15,
)
"""Hokuyo's, as on race cars, from its data sheet; the mirror covers 270° in three quarters of its turn."""
URG_04LX = LaserModel(
    beams=683,
    field_of_view=240.0,
    scan_time=0.1,
    sweep_share=0.667,
    range_min=0.06,
    range_max=4.0,
    noise=0.02,
    dropouts=0.5,
    height=0.25,
)
"""Hokuyo's small one, from its data sheet; half of the beams find walls too dark, as in recordings."""
RPLIDAR_A1 = LaserModel(
    beams=360,
    field_of_view=359.0,
    scan_time=0.14,
    sweep_share=1.0,
    range_min=0.15,
    range_max=12.0,
    noise=0.02,
    dropouts=0.05,
    height=0.2,
)
"""Slamtec's, from its data sheet: it sees all around, including anyone walking behind."""
LMS_291 = LaserModel(
    beams=361,
    field_of_view=180.0,
    scan_time=0.1,
    sweep_share=0.13,
    range_min=0.1,
    range_max=80.0,
    noise=0.02,
    dropouts=0.02,
    height=0.5,
    faint_range=35.0,
)
"""Sick's, from its data sheet: 80 m, but 30 m for a reflectance of a tenth; it turns 75 times a second, of
which loggers keep some ten."""

LASERS: Mapping[LaserKind, LaserModel] = {
    LaserKind.RACE: UST_10LX,
    LaserKind.SHORT: URG_04LX,
    LaserKind.ROUND: RPLIDAR_A1,
    LaserKind.OUTDOOR: LMS_291,
}
