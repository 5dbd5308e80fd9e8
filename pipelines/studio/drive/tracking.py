"""Filters that follow the car, held against the truth."""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.runs.evaluation.course_filter import CourseFilter, CourseSettings
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_SHOWN_PARTICLES = 500
"""Of each filter: a browser draws so many arrows in passing, and more would only cover each other."""
_REMEMBERED = 1200
"""Scans whose errors are kept: a minute."""
_COURSE_START = np.diag([0.25, 0.25, 0.06])
"""Variances (m², rad²) with which the course's filter starts about a pose, as ours does by default."""


class TrackingError(NamedTuple):
    """How far a filter is off."""

    seconds: float
    metres: float
    radians: float


class Tracking:
    """Our localizer and, where it is wanted, the course's filter beside it."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, start: Pose) -> None:
        """The localizer knows the start pose (3,) roughly. Raises UserError when the map is of no use."""
        self._grid, self._rng = grid, np.random.default_rng(0)
        self.config = config
        self._localizer = Localizer(grid, config, self._rng)
        self._localizer.set_pose(start)
        self._course: CourseFilter | None = None
        self.course_error: float | None = None
        """Metres by which the course's filter was off at the last scan; None where it does not run."""
        self.estimate: PoseEstimate | None = None
        """Of our localizer, at the last scan."""
        self.errors: deque[TrackingError] = deque(maxlen=_REMEMBERED)

    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        """Follow the sensors for a while, at whose end the car is at the true pose (3,)."""
        for measurement in measured:
            estimate = feed(measurement, self._localizer)
            if isinstance(measurement, Scan):
                self.estimate = estimate
            if self._course is not None:
                guess = feed(measurement, self._course)
                if guess is not None:
                    self.course_error = float(np.hypot(*(guess.map_from_base - truth)[:2]))
        now = self._localizer.pose_at(max((each.stamp for each in measured), default=0))
        if now is not None:
            off = now.map_from_base - truth
            self.errors.append(
                TrackingError(seconds, float(np.hypot(*off[:2])), abs(float(wrap_angle(off[2]))))
            )

    def start_at(self, pose: Pose) -> None:
        """Start about a pose (3,). Raises UserError when the car cannot be there."""
        self._localizer.set_pose(pose)
        if self._course is not None:
            self._course.set_pose(pose, _COURSE_START)

    def start_near(self, place: NDArray[np.float64], radius: float) -> None:
        """Start from anywhere about a place (2,). Raises UserError when the car cannot be there."""
        self._localizer.set_position(place, radius)

    def scatter(self) -> None:
        """Start from anywhere on the map; the course's filter has no such thing and stays."""
        self._localizer.scatter()

    def set_course(self, settings: CourseSettings | None, start: Pose) -> None:
        """Run the course's filter too, from a pose (3,) on, or no longer."""
        self._course, self.course_error = None, None
        if settings is not None:
            self._course = CourseFilter(self._grid, settings, self._rng)
            self._course.set_pose(start, _COURSE_START)

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Other settings from the next scan on."""
        self.config = config
        self._localizer.reconfigure(config)

    def particles(self) -> tuple[Pose, int]:
        """(P, 3) some of our particles that stand for all, and how many there are."""
        return _some(*self._localizer.particles(), self._rng)

    def course_particles(self) -> Pose:
        """(P, 3) some of the course's filter; none where it does not run."""
        return np.zeros((0, 3)) if self._course is None else _some(*self._course.particles(), self._rng)[0]


def _some(poses: Pose, weights: NDArray[np.float64], rng: np.random.Generator) -> tuple[Pose, int]:
    if len(poses) <= _SHOWN_PARTICLES:
        return poses, len(poses)
    return poses[rng.choice(len(poses), _SHOWN_PARTICLES, p=weights / weights.sum())], len(poses)
