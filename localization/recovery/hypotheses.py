"""Where the car may be: the hypothesis that is believed, and another while that one is in doubt.

Another is born while the believed one seems lost: the map is searched for where the scan fits. Scans judge
both by how they agree with the map, and the one wins that they confirm first. The other goes when the first
is confirmed, or when it seems lost too after its trial; then the map is searched again.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.filter.start_poses import draw_about, draw_start, region_about
from racecar.localization.floor.region import ANYWHERE, Region
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.lost_detector import LostDetector
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.pose_hypothesis import PoseHypothesis
from racecar.localization.recovery.surveyed_map import survey, survey_settings
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid


class Hypotheses:
    """The clouds of particles, taken together from scan to scan."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """The car may be anywhere on a map, which is surveyed; raises UserError as `survey` does."""
        self._rng = rng
        self._config = config
        surveyed = survey(grid, config)
        self.perception = Perception(surveyed, config)
        self.is_started = False
        """Whether a scan came since the start."""
        self.shown: tuple[Pose, NDArray[np.float64]]
        """Poses (N, 3) and weights (N,) of what is believed, as they were after the last scan or start."""
        self._travel = self._seconds = 0.0
        """Since the scan that was weighed last."""
        self._sought: Region | None = None
        """Where the first scan is sought; None where it chooses among the particles."""
        detector = LostDetector(surveyed.shares_when_lost, config.lost_detector)
        self.believed = PoseHypothesis(self._cloud(np.zeros((1, 3))), detector, 0)
        self._other: PoseHypothesis | None = None
        self.start_in(ANYWHERE)

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from here on; where the survey of the map depends on them, it is made anew."""
        surveyed = self.perception.surveyed
        if survey_settings(config) != survey_settings(self._config):
            surveyed = survey(surveyed.walls.grid, config)
            self.believed.lost = LostDetector(surveyed.shares_when_lost, config.lost_detector)
        self._config = config
        self.perception = Perception(surveyed, config)
        for each in self._all:
            each.particles.config = config.particle_filter

    def start_at(self, map_from_base: Pose, covariance: NDArray[np.float64] | None) -> None:
        """Start anew at a pose (3,) that somebody gave, who may be mistaken: see `draw_start`."""
        free_space = self.perception.surveyed.free_space
        self._start_from(draw_start(map_from_base, covariance, free_space, self._config, self._rng))

    def start_within(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew within a radius of a point (2,) that somebody gave, likewise: see `region_about`."""
        self.start_in(region_about(point_in_map, radius, self.perception.surveyed.free_space))

    def start_about(self, map_from_base: Pose) -> None:
        """Start anew about a pose (3,), on free space or not."""
        self._start_from(draw_about(map_from_base, self._config.particles, self._config, self._rng))

    def start_in(self, region: Region) -> None:
        """Start anew from anywhere in a region, which is searched when the next scan comes."""
        free_space = self.perception.surveyed.free_space.within(region)
        self._start_from(free_space.draw_poses(self._config.scattered_particles, self._rng))
        self._sought = region

    def go_on_about(self, map_from_base: Pose) -> None:
        """What is believed goes on about another pose (3,), as unsure as of a car that was pushed."""
        noise = self._rng.standard_normal((self._config.particles, 3))
        self.believed.particles = self._cloud(map_from_base + self._pushed * noise)

    def predict(self, step: MotionStep, slip_scale: Pose) -> None:
        """Move the particles by what odometry measured, or what the car is taken to have done.

        It has proven right, and deserves less slip (2,), only from the place that is in doubt now.
        """
        self.believed.particles.predict(step, self._config.slip, slip_scale)
        if self._other is not None:
            self._other.particles.predict(step, self._config.slip)
        self._travel += step.travel
        self._seconds += step.seconds

    def weigh(self, beams: Beams) -> None:
        """Take in a scan, if it has beams and is news."""
        if len(beams) == 0:
            return
        if not self.is_started:
            self._begin(beams)
        elif self._is_news():
            for each in self._all:
                each.weigh(beams, self._travel, self.perception)
        else:
            return
        self._travel = self._seconds = 0.0

    def estimate(self, beams: Beams, stamp: int, seconds: float, is_start: bool) -> PoseEstimate:
        """Where the hypothesis that is believed has the car."""
        return self.believed.estimate(beams, stamp, seconds, is_start, self.perception)

    def contest(self, estimate: PoseEstimate, beams: Beams, seconds: float) -> PoseEstimate:
        """The estimate of the hypothesis that is believed, or of the other, which is from now on."""
        config, perception, stamp = self._config.hypothesis, self.perception, estimate.stamp
        if len(beams) == 0:
            return estimate
        is_lost = self.believed.lost.probability >= config.search_from
        if is_lost and (self._other is None or self._other.has_failed(stamp, config.trial_seconds)):
            detector = self.believed.lost.for_another_place()
            self._other = PoseHypothesis(self._search(beams), detector, stamp)
        if self._other is None:
            return estimate
        elsewhere = self._other.estimate(beams, stamp, seconds, True, perception)
        if self.believed.lost.probability < config.confirmed_below:
            self._other = None
        elif self._other.lost.probability < config.confirmed_below:
            self.believed, self._other = self._other, None
            return elsewhere
        return estimate

    def resample(self) -> None:
        """Draw particles anew where it is time."""
        for each in self._all:
            each.resample(self._config)
        self._show()

    @property
    def _all(self) -> list[PoseHypothesis]:
        return [self.believed] if self._other is None else [self.believed, self._other]

    def _start_from(self, map_from_base: Pose) -> None:
        """Start anew from poses (N, 3), of which the next scan chooses."""
        self.believed = PoseHypothesis(self._cloud(map_from_base), self.believed.lost.for_another_place(), 0)
        self._other = None
        self._sought = None
        self.is_started = False
        self._show()

    def _show(self) -> None:
        """Replaced as a whole, so that readers neither wait nor see two scans mixed."""
        self.shown = self.believed.particles.map_from_base, self.believed.particles.weights

    def _is_news(self) -> bool:
        """Whether a scan counts: the car has moved, or may have been moved unnoticed in the meantime."""
        tracking = self._config.tracking
        if self._travel >= tracking.news_after:
            return True
        if self._seconds < tracking.look_again_after:
            return False
        self.believed.particles.inject(self._pushed)
        return True

    @property
    def _pushed(self) -> Pose:
        """(3,) metres and radians by which a car whose wheels stand may have moved unnoticed."""
        tracking = self._config.tracking
        return np.array([tracking.pushed_distance, tracking.pushed_distance, tracking.pushed_angle])

    def _begin(self, beams: Beams) -> None:
        """Take in a first scan, which chooses the places to start from."""
        self.is_started = True
        if self._sought is not None:
            self.believed.particles = self._search(beams, self._sought)
        else:
            share = self._config.tracking.first_scan_share
            self.believed.particles = self._chosen(self.believed.particles.map_from_base, beams, share)

    def _search(self, beams: Beams, region: Region = ANYWHERE) -> ParticleFilter:
        """Particles where in a region a scan fits."""
        count, places = self._config.scattered_particles, self.perception.surveyed.places
        found = places.find(beams, self._config.squash, count, self._rng, region)
        return self._chosen(found, beams, share=1.0)

    def _chosen(self, map_from_base: Pose, beams: Beams, share: float) -> ParticleFilter:
        """Particles among poses (N, 3), by a share of a scan's log-likelihood."""
        config, particles = self._config, self._cloud(map_from_base)
        particles.weigh(share * self.perception.log_likelihood(map_from_base, beams))
        particles.resample(config.particles)
        distance, angle = config.tracking.first_scan_distance, config.tracking.first_scan_angle
        particles.spread(np.array([distance, distance, angle]))
        return particles

    def _cloud(self, map_from_base: Pose) -> ParticleFilter:
        return ParticleFilter(map_from_base, self._rng, self._config.particle_filter)
