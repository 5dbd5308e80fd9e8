"""Filters that follow the car, held against the truth."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.runs.evaluation.course_filter import CourseFilter, CourseSettings
from racecar.pipelines.studio.drive.follower import Follower
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_SHOWN_PARTICLES = 500
"""Of each filter: a browser draws so many arrows in passing, and more would only cover each other."""
_COURSE_START = np.diag([0.25, 0.25, 0.06])
"""Variances (m², rad²) with which the course's filter starts about a pose, as ours does by default."""


class Tracking(Follower):
    """Our localizer and, where it is wanted, the course's filter beside it."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, start: Pose) -> None:
        """The localizer knows the start pose (3,) roughly. Raises UserError when the map is of no use."""
        super().__init__()
        self._grid, self._rng = grid, np.random.default_rng(0)
        self.localizer = Localizer(grid, config, self._rng)
        self.localizer.set_pose(start)
        self._course: CourseFilter | None = None
        self.course_error: float | None = None
        """Metres by which the course's filter was off at the last scan; None where it does not run."""
        self.estimate: PoseEstimate | None = None
        """Of our localizer, at the last scan."""

    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        """Localize."""
        for measurement in measured:
            estimate = feed(measurement, self.localizer)
            if isinstance(measurement, Scan):
                self.estimate = estimate
            if self._course is not None:
                guess = feed(measurement, self._course)
                if guess is not None:
                    self.course_error = float(np.hypot(*(guess.map_from_base - truth)[:2]))
        now = self.localizer.pose_at(max((each.stamp for each in measured), default=0))
        if now is not None:
            self.note_error(now.map_from_base, truth, seconds)

    def start_at(self, pose: Pose) -> None:
        """Start about a pose (3,). Raises UserError when the car cannot be there."""
        self.localizer.set_pose(pose)
        if self._course is not None:
            self._course.set_pose(pose, _COURSE_START)

    def set_course(self, settings: CourseSettings | None, start: Pose) -> None:
        """Run the course's filter too, from a pose (3,) on, or no longer."""
        self._course, self.course_error = None, None
        if settings is not None:
            self._course = CourseFilter(self._grid, settings, self._rng)
            self._course.set_pose(start, _COURSE_START)

    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        """With particles and covariance."""
        if self.estimate is None or scan is None:
            return None
        pose = self.estimate.map_from_base
        points = transform_points(pose, scan.points_in_base())
        particles = _some(*self.localizer.particles(), self._rng)
        return Glimpse(pose, points, None, particles, self.estimate.covariance)

    def course_particles(self) -> Pose:
        """(P, 3) some of the course's filter; none where it does not run."""
        return np.zeros((0, 3)) if self._course is None else _some(*self._course.particles(), self._rng)

    def words(self) -> str:
        """How it goes, in Markdown."""
        if self.estimate is None or not self.errors:
            return "Waiting for a scan."
        error = self.errors[-1]
        words = (
            f"The localizer {'**lost**' if self.estimate.is_lost else 'knows its place'}: off by "
            f"**{100 * error.metres:.1f} cm**, {np.degrees(error.radians):.1f}°; "
            f"{len(self.localizer.particles()[0])} particles."
        )
        if self.course_error is not None:
            words += f" The course's filter: off by **{100 * self.course_error:.0f} cm**."
        return words


def _some(poses: Pose, weights: NDArray[np.float64], rng: np.random.Generator) -> Pose:
    """Some particles that stand for all."""
    if len(poses) <= _SHOWN_PARTICLES:
        return poses
    return poses[rng.choice(len(poses), _SHOWN_PARTICLES, p=weights / weights.sum())]
