"""Filters that track the car, compared with the truth."""

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
"""Maximum particles of each filter, which a browser draws easily; more would only hide each other."""
_COURSE_START = np.diag([0.25, 0.25, 0.06])
"""Variances (m², rad²) of the course's filter around a start pose, the same as our default."""


class Tracking(Follower):
    """Our localizer and, on request, the course's filter beside it."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, start: Pose) -> None:
        """``start`` (3,) is the approximate start pose. Raises UserError when the map is unusable."""
        super().__init__()
        self._grid, self._rng = grid, np.random.default_rng(0)
        self.localizer = Localizer(grid, config, self._rng)
        self.localizer.set_pose(start)
        self._course: CourseFilter | None = None
        self.course_error: float | None = None
        """Position error in metres of the course's filter at the last scan; None if it is not running."""
        self.estimate: PoseEstimate | None = None
        """Estimate of our localizer at the last scan."""

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
        """Start around a pose (3,). Raises UserError when the car cannot be there."""
        self.localizer.set_pose(pose)
        if self._course is not None:
            self._course.set_pose(pose, _COURSE_START)

    def set_course(self, settings: CourseSettings | None, start: Pose) -> None:
        """Run the course's filter too, starting at a pose (3,); None stops it."""
        self._course, self.course_error = None, None
        if settings is not None:
            self._course = CourseFilter(self._grid, settings, self._rng)
            self._course.set_pose(start, _COURSE_START)

    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        """Includes particles and covariance."""
        if self.estimate is None or scan is None:
            return None
        pose = self.estimate.map_from_base
        points = transform_points(pose, scan.points_in_base())
        particles = _some(*self.localizer.particles(), self._rng)
        return Glimpse(pose, points, None, particles, self.estimate.covariance)

    def course_particles(self) -> Pose:
        """(P, 3) some particles of the course's filter; none if it is not running."""
        return np.zeros((0, 3)) if self._course is None else _some(*self._course.particles(), self._rng)

    def words(self) -> str:
        """The current state, in Markdown."""
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
    """A sample that represents all particles."""
    if len(poses) <= _SHOWN_PARTICLES:
        return poses
    return poses[rng.choice(len(poses), _SHOWN_PARTICLES, p=weights / weights.sum())]
