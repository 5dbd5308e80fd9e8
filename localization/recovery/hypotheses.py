"""Hypotheses of the car's pose: the current one, and an alternative while that one is in doubt.

When the current one seems lost, the alternative is searched for on the whole map. Scans judge each by its fit
to the map, and both against each other; the first to be confirmed wins. The alternative is dropped when the
current one is confirmed, or when it seems lost too after its trial; then the map is searched again.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

_COUNTS_AFTER = 0.02
"""Metres plus radians of motion after which a scan counts, since scans of a standing car repeat themselves:
counted as independent they would narrow the cloud to a point. Chosen by judgement."""
_LOOK_AGAIN_AFTER = 0.5
"""Seconds after which a scan counts although the wheels stand still, since the car may be sliding or pushed.
Chosen by judgement."""
_UNNOTICED = 0.005
"""Metres of travel assigned to such a scan: few, since it repeats the last. Measured: with 0.02 the cloud of
a car that stands for a minute narrows by half."""
_PUSHED = np.array([0.1, 0.1, 0.05])
"""(3,) metres and radians by which a few particles may have moved meanwhile, since a car may be pushed while
its wheels stand still. Chosen by judgement."""
_FIRST_SCAN_SHARE = 0.25
"""Weight of the first scan's log-likelihood around a given pose, because where the map has changed, another
place fits better (measured: up to 1.4 m away), which only driving refutes."""
_FIRST_SCAN_SPREAD = np.array([0.05, 0.05, 0.02])
"""(3,) metres and radians by which particles are spread after the first scan, about the width of its
likelihood, since they are copies of few (Musso, Oudjane and Le Gland: Improving regularised particle filters,
2001). Without that, a start whose laser is covered after a fifth of a second was carried on half a dozen
times worse by odometry."""
_SEARCH_FROM = 0.7
"""Probability of being lost from which the map is searched: more than even, since a search takes longer than
a scan. Tried on recordings."""
CONFIRMED_BELOW = 0.02
"""Probability of being lost below which a hypothesis is confirmed, since the first to reach it wins: 50 to 1.
Chosen by judgement."""
_BETTER = 2.0
"""Log-likelihood by which a scan must fit better elsewhere to count against the current place. Chosen by
judgement: more than people and moved things cause by chance."""


class Hypotheses:
    """The particle clouds of all hypotheses."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Starts anywhere on the map, which is analyzed; raises UserError as `Perception` does."""
        self._rng = rng
        self.config = config
        self.perception = Perception(grid)
        self.is_started = False
        """Whether there was a scan since the start."""
        self.shown: tuple[Pose, NDArray[np.float64]]
        """Poses (N, 3) and weights (N,) of the current hypothesis after the last scan or start."""
        self._travel = self._seconds = 0.0
        """Since the last weighted scan."""
        self._search_region: Region | None = None
        """Region to search with the first scan; None if it weights the particles."""
        self.believed = PoseHypothesis(self._cloud(np.zeros((1, 3))), PlaceJudge(), 0)
        self._other: PoseHypothesis | None = None
        self._lookout = Lookout()
        self._counted_seconds = 0.0
        """Time since the last counted scan; 0 if the present one does not count."""
        self.start_in(ANYWHERE)

    def start_at(self, map_from_base: ArrayLike, covariance: ArrayLike | None) -> None:
        """Restart at a given pose (3,), which may be slightly wrong: see `draw_start`."""
        free_space = self.perception.free_space
        self._start_from(draw_start(map_from_base, covariance, free_space, self.config, self._rng))

    def start_within(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Restart within a radius of a given point (2,), likewise: see `region_about`."""
        self.start_in(region_about(point_in_map, radius, self.perception.free_space))

    def start_about(self, map_from_base: Pose) -> None:
        """Restart around a pose (3,), in free space or not."""
        self._start_from(draw_about(map_from_base, self.config.particles, self.config, self._rng))

    def start_in(self, region: Region) -> None:
        """Restart anywhere in a region, which is searched with the next scan."""
        free_space = self.perception.free_space.within(region)
        self._start_from(free_space.draw_poses(self.config.scattered_particles, self._rng))
        self._search_region = region

    def continue_at(self, map_from_base: Pose) -> None:
        """Continue the current hypothesis around another pose (3,), as uncertain as after a push."""
        noise = self._rng.standard_normal((self.config.particles, 3))
        self.believed.particles = self._cloud(map_from_base + _PUSHED * noise)

    def predict(self, step: MotionStep, slip_scale: Pose) -> None:
        """Move the particles by the measured or assumed motion of the car.

        Less slip (2,) is only for the current hypothesis, whose poses have calibrated the odometry.
        """
        self.believed.particles.predict(step, self.config.slip, slip_scale)
        if self._other is not None:
            self._other.particles.predict(step, self.config.slip)
        self._travel += step.travel
        self._seconds += step.seconds

    def weigh(self, points: EndPoints) -> None:
        """Add a scan, if it has points and counts."""
        self._counted_seconds = 0.0
        if len(points) == 0:
            return
        if not self.is_started:
            self._begin(points)
        elif self._counts():
            travel = max(self._travel, _UNNOTICED)
            for each in self._all:
                each.weigh(points, travel, self.perception)
            self._counted_seconds = self._seconds
        else:
            return
        self._travel = self._seconds = 0.0

    def estimate(self, points: EndPoints, stamp: int, seconds: float, is_start: bool) -> PoseEstimate:
        """The estimate of the current hypothesis."""
        return self.believed.estimate(points, stamp, seconds, is_start, self.perception)

    def contest(self, estimate: PoseEstimate, points: EndPoints, seconds: float) -> PoseEstimate:
        """The estimate of the winner, which is the current hypothesis from now on."""
        if estimate.fit is None:
            return estimate
        estimate = self._compared_with_map(estimate, points, seconds)
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
            self._lookout.reset()
            return elsewhere
        return estimate

    def resample(self) -> None:
        """Resample the particles of all hypotheses where needed."""
        for each in self._all:
            each.resample(self.config)
        self._show()

    def _compared_with_map(self, estimate: PoseEstimate, points: EndPoints, seconds: float) -> PoseEstimate:
        """The estimate of the current hypothesis, compared with a part of the map if the scan counts."""
        if not self.believed.is_known or estimate.is_start:
            self._lookout.reset()
            return estimate
        if self._counted_seconds == 0.0:
            return estimate
        look = self._lookout.look(estimate.map_from_base, points, self._counted_seconds, self.perception)
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
        """Compare two hypotheses by a scan, if each is at one place."""
        if first.is_known and second.is_known:
            poses = np.stack([here.map_from_base, there.map_from_base])
            by_first, by_second = self.perception.log_likelihood(poses, points).tolist()
            first.judge.compare(by_first - by_second, seconds)
            second.judge.compare(by_second - by_first, seconds)

    @property
    def _all(self) -> list[PoseHypothesis]:
        return [self.believed] if self._other is None else [self.believed, self._other]

    def _start_from(self, map_from_base: Pose) -> None:
        """Restart from poses (N, 3), among which the next scan selects."""
        self.believed = PoseHypothesis(self._cloud(map_from_base), self.believed.judge.for_another_place(), 0)
        self._other = None
        self._lookout.reset()
        self._search_region = None
        self.is_started = False
        self._show()

    def _show(self) -> None:
        """Replaced atomically, so that readers neither wait nor see a mix of two scans."""
        self.shown = self.believed.particles.map_from_base, self.believed.particles.weights

    def _counts(self) -> bool:
        """Whether a scan counts: the car has moved, or may have been moved unnoticed."""
        if self._travel >= _COUNTS_AFTER:
            return True
        if self._seconds < _LOOK_AGAIN_AFTER:
            return False
        self.believed.particles.inject(_PUSHED)
        return True

    def _begin(self, points: EndPoints) -> None:
        """Add the first scan, which selects the start poses."""
        self.is_started = True
        if self._search_region is not None:
            self.believed.particles = self._search(points, self._search_region)
        else:
            given = self.believed.particles.map_from_base
            self.believed.particles = self._chosen(given, points, _FIRST_SCAN_SHARE)

    def _search(self, points: EndPoints, region: Region = ANYWHERE) -> ParticleFilter:
        """Particles where a scan fits within a region."""
        count, places = self.config.scattered_particles, self.perception.places
        found = places.find(points, count, self._rng, region)
        return self._chosen(found, points, share=1.0)

    def _chosen(self, map_from_base: Pose, points: EndPoints, share: float) -> ParticleFilter:
        """Particles resampled from poses (N, 3) by a share of a scan's log-likelihood."""
        particles = self._cloud(map_from_base)
        particles.weigh(share * self.perception.log_likelihood(map_from_base, points))
        particles.resample(self.config.particles)
        particles.spread(_FIRST_SCAN_SPREAD)
        return particles

    def _cloud(self, map_from_base: Pose) -> ParticleFilter:
        return ParticleFilter(map_from_base, self._rng)
