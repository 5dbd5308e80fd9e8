"""Where the car may be: the hypothesis that is believed, and another while that one is in doubt.

Another is born while the believed one seems lost: the map is searched for where the scan fits. Scans judge
both by how they fit the map, and which of the two better, and the one wins that they confirm first. The other
goes when the first is confirmed, or when it seems lost too after its trial; then the map is searched again.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.filter.start_poses import draw_about, draw_start, region_about
from racecar.localization.floor.free_space import ANYWHERE, Region
from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.lookout import Lookout
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import PlaceJudge
from racecar.localization.recovery.pose_hypothesis import PoseHypothesis
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid

_NEWS_AFTER = 0.02
"""Metres plus radians of motion after which a scan counts, since those of a car that stands repeat
themselves: counted as independent they would narrow the cloud to a point. By judgement."""
_LOOK_AGAIN_AFTER = 0.5
"""Seconds after which a scan counts although the wheels stand, since the car may be sliding or pushed. By
judgement."""
_UNNOTICED = 0.005
"""Metres of travel that such a scan counts as: few, since it repeats the last. Measured: with 0.02 the
cloud of a car that stands for a minute narrows by half."""
_PUSHED = np.array([0.1, 0.1, 0.05])
"""(3,) metres and radians by which a few particles may have moved meanwhile, since somebody may push a car
whose wheels stand. By judgement."""
_FIRST_SCAN_SHARE = 0.25
"""Of a first scan's log-likelihood, that counts about a given pose, because where the map has changed,
another place fits better (measured: up to 1.4 m away), which only driving refutes."""
_FIRST_SCAN_SPREAD = np.array([0.05, 0.05, 0.02])
"""(3,) metres and radians by which the particles that a first scan leaves are spread, about the width of its
likelihood, since they are copies of few (Musso, Oudjane and Le Gland: Improving regularised particle filters,
2001). Without that, a start whose laser is covered after a fifth of a second was carried on half a dozen
times worse by odometry."""
_SEARCH_FROM = 0.7
"""Probability of being lost from which the map is searched: more than even, since a search takes longer
than a scan. Tried on recordings."""
CONFIRMED_BELOW = 0.02
"""Probability of being lost below which the car is taken to be there, since the first hypothesis that comes
to this wins: 50 to 1. By judgement."""
_BETTER = 2.0
"""Log-likelihood by which a scan must fit better elsewhere to speak against the place: by judgement, more
than people and moved things that a scan meets by chance do to it."""


class Hypotheses:
    """The clouds of particles, taken together from scan to scan."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """The car may be anywhere on a map, which is surveyed; raises UserError as `Perception` does."""
        self._rng = rng
        self.config = config
        self.perception = Perception(grid)
        self.is_started = False
        """Whether a scan came since the start."""
        self.shown: tuple[Pose, NDArray[np.float64]]
        """Poses (N, 3) and weights (N,) of what is believed, as they were after the last scan or start."""
        self._travel = self._seconds = 0.0
        """Since the scan that was weighed last."""
        self._sought: Region | None = None
        """Where the first scan is sought; None where it chooses among the particles."""
        self.believed = PoseHypothesis(self._cloud(np.zeros((1, 3))), PlaceJudge(), 0)
        self._other: PoseHypothesis | None = None
        self._lookout = Lookout()
        self._news_seconds = 0.0
        """Of the scan at hand; 0 where it is no news."""
        self.start_in(ANYWHERE)

    def start_at(self, map_from_base: Pose, covariance: NDArray[np.float64] | None) -> None:
        """Start anew at a pose (3,) that somebody gave, who may be mistaken: see `draw_start`."""
        free_space = self.perception.free_space
        self._start_from(draw_start(map_from_base, covariance, free_space, self.config, self._rng))

    def start_within(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew within a radius of a point (2,) that somebody gave, likewise: see `region_about`."""
        self.start_in(region_about(point_in_map, radius, self.perception.free_space))

    def start_about(self, map_from_base: Pose) -> None:
        """Start anew about a pose (3,), on free space or not."""
        self._start_from(draw_about(map_from_base, self.config.particles, self.config, self._rng))

    def start_in(self, region: Region) -> None:
        """Start anew from anywhere in a region, which is searched when the next scan comes."""
        free_space = self.perception.free_space.within(region)
        self._start_from(free_space.draw_poses(self.config.scattered_particles, self._rng))
        self._sought = region

    def go_on_about(self, map_from_base: Pose) -> None:
        """What is believed goes on about another pose (3,), as unsure as of a car that was pushed."""
        noise = self._rng.standard_normal((self.config.particles, 3))
        self.believed.particles = self._cloud(map_from_base + _PUSHED * noise)

    def predict(self, step: MotionStep, slip_scale: Pose) -> None:
        """Move the particles by what odometry measured, or what the car is taken to have done.

        It has proven right, and deserves less slip (2,), only from the place that is in doubt now.
        """
        self.believed.particles.predict(step, self.config.slip, slip_scale)
        if self._other is not None:
            self._other.particles.predict(step, self.config.slip)
        self._travel += step.travel
        self._seconds += step.seconds

    def weigh(self, points: EndPoints) -> None:
        """Take in a scan, if it has points and is news."""
        self._news_seconds = 0.0
        if len(points) == 0:
            return
        if not self.is_started:
            self._begin(points)
        elif self._is_news():
            travel = max(self._travel, _UNNOTICED)
            for each in self._all:
                each.weigh(points, travel, self.perception)
            self._news_seconds = self._seconds
        else:
            return
        self._travel = self._seconds = 0.0

    def estimate(self, points: EndPoints, stamp: int, seconds: float, is_start: bool) -> PoseEstimate:
        """Where the hypothesis that is believed has the car."""
        return self.believed.estimate(points, stamp, seconds, is_start, self.perception)

    def contest(self, estimate: PoseEstimate, points: EndPoints, seconds: float) -> PoseEstimate:
        """The estimate of the hypothesis that is believed, or of the other, which is from now on."""
        if estimate.fit is None:
            return estimate
        estimate = self._looked_out(estimate, points, seconds)
        stamp, is_lost = estimate.stamp, self.believed.judge.probability_lost >= _SEARCH_FROM
        if is_lost and (self._other is None or self._other.has_failed(stamp)):
            judge = self.believed.judge.for_another_place()
            self._other = PoseHypothesis(self._search(points), judge, stamp)
        if self._other is None:
            return estimate
        elsewhere = self._other.estimate(points, stamp, seconds, True, self.perception)
        self._compare(self.believed, estimate, self._other, elsewhere, points, seconds)
        if self.believed.judge.probability_lost < CONFIRMED_BELOW:
            self._other = None
        elif self._other.judge.probability_lost < CONFIRMED_BELOW:
            self.believed, self._other = self._other, None
            self._lookout.start_anew()
            return elsewhere
        return estimate

    def resample(self) -> None:
        """Draw particles anew where it is time."""
        for each in self._all:
            each.resample(self.config)
        self._show()

    def _looked_out(self, estimate: PoseEstimate, points: EndPoints, seconds: float) -> PoseEstimate:
        """The estimate of what is believed, compared with a part of the map where the scan is news."""
        if not self.believed.is_known or estimate.is_start:
            self._lookout.start_anew()
            return estimate
        if self._news_seconds == 0.0:
            return estimate
        look = self._lookout.look(estimate.map_from_base, points, self._news_seconds, self.perception)
        if look is None:
            return estimate
        if look.margin < -_BETTER:
            self.believed.judge.compare(look.margin, look.seconds)
        return replace(estimate, margin=look.whole_margin)

    def _compare(
        self,
        first: PoseHypothesis,
        here: PoseEstimate,
        second: PoseHypothesis,
        there: PoseEstimate,
        points: EndPoints,
        seconds: float,
    ) -> None:
        """Let a scan decide between two hypotheses that lie at one place each."""
        if first.is_known and second.is_known:
            poses = np.stack([here.map_from_base, there.map_from_base])
            by_first, by_second = self.perception.log_likelihood(poses, points).tolist()
            first.judge.compare(by_first - by_second, seconds)
            second.judge.compare(by_second - by_first, seconds)

    @property
    def _all(self) -> list[PoseHypothesis]:
        return [self.believed] if self._other is None else [self.believed, self._other]

    def _start_from(self, map_from_base: Pose) -> None:
        """Start anew from poses (N, 3), of which the next scan chooses."""
        self.believed = PoseHypothesis(self._cloud(map_from_base), self.believed.judge.for_another_place(), 0)
        self._other = None
        self._lookout.start_anew()
        self._sought = None
        self.is_started = False
        self._show()

    def _show(self) -> None:
        """Replaced as a whole, so that readers neither wait nor see two scans mixed."""
        self.shown = self.believed.particles.map_from_base, self.believed.particles.weights

    def _is_news(self) -> bool:
        """Whether a scan counts: the car has moved, or may have been moved unnoticed in the meantime."""
        if self._travel >= _NEWS_AFTER:
            return True
        if self._seconds < _LOOK_AGAIN_AFTER:
            return False
        self.believed.particles.inject(_PUSHED)
        return True

    def _begin(self, points: EndPoints) -> None:
        """Take in a first scan, which chooses the places to start from."""
        self.is_started = True
        if self._sought is not None:
            self.believed.particles = self._search(points, self._sought)
        else:
            given = self.believed.particles.map_from_base
            self.believed.particles = self._chosen(given, points, _FIRST_SCAN_SHARE)

    def _search(self, points: EndPoints, region: Region = ANYWHERE) -> ParticleFilter:
        """Particles where in a region a scan fits."""
        count, places = self.config.scattered_particles, self.perception.places
        found = places.find(points, count, self._rng, region)
        return self._chosen(found, points, share=1.0)

    def _chosen(self, map_from_base: Pose, points: EndPoints, share: float) -> ParticleFilter:
        """Particles among poses (N, 3), by a share of a scan's log-likelihood."""
        particles = self._cloud(map_from_base)
        particles.weigh(share * self.perception.log_likelihood(map_from_base, points))
        particles.resample(self.config.particles)
        particles.spread(_FIRST_SCAN_SPREAD)
        return particles

    def _cloud(self, map_from_base: Pose) -> ParticleFilter:
        return ParticleFilter(map_from_base, self._rng)
