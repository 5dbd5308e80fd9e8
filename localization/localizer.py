"""The localizer of a live car: odometry and scans in, poses out."""

from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.filter.start_poses import draw_about, draw_anywhere, draw_start, draw_within
from racecar.localization.filter.tempering import temper
from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.range_table.range_table import affordable_cells, build_range_table
from racecar.localization.floor.walls import find_walls
from racecar.localization.odometry.calibration import OdometryFaults
from racecar.localization.odometry.motion_model_kernels import carry
from racecar.localization.odometry.motion_source import RESTART_SECONDS, MotionSource
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments import OdometryStretches
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hypothesis import Rival
from racecar.localization.recovery.lost_detector import LostDetector, agreement_shares
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beam_skipping import Alignment, Explanation, explain
from racecar.localization.sensor.beams import Beams, select_beams
from racecar.localization.sensor.likelihood_field import LikelihoodField
from racecar.localization.sensor.sensor_model import SensorModel
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan

_NEWS_AFTER = 0.02
"""Metres plus radians of motion after which a scan tells something new. Scans of a car that stands repeat
themselves; counted as independent, they would narrow the cloud to a point."""
_LOOK_AGAIN_AFTER = 0.5
_PUSHED = np.array([0.1, 0.1, 0.05])
"""Seconds after which a car that stands looks again all the same, and by how many metres and radians it may
have slid or been pushed."""
_DOUBTFUL = 0.7
"""Probability of being lost at which the map is searched."""
_FOUND = 0.02
"""Probability of being lost at which no other place is thought of any more."""
_FAR_ADVANTAGE = 0.5
"""By how much more a beam's log-probability must be at a far place than at one near the last, on average.
What has changed since the map was made costs nearly as much at the right place, and may not at one alike."""
_FIRST_SCAN_COUNTS = 0.25
"""Share of a first scan's log-likelihood about a told place: where the map has changed, another may fit
better, which only driving refutes."""
_DOMINANT = 0.9
"""Weight of a cluster beside which the others do not matter."""
_TRACKED, _NARROW, _TRUSTED = 0.5, 0.25, 0.1
"""Metres of standard deviation within which the place counts as known, as known well, and well enough to hold
it against the odometry."""


@dataclass(frozen=True, eq=False)
class _Published:
    """What one scan came to; replaced as a whole, so that readers neither wait nor see two scans mixed."""

    estimate: PoseEstimate
    odom_from_base: Pose | None
    """At the estimate's stamp, where odometry told it."""
    faults: OdometryFaults
    """Of the odometry, as known then."""


class Localizer:
    """Tells the car's pose on a map; its methods may be called from several threads at once.

    `add_odometry`, `pose_at` and `particles` do not wait for a scan that is being worked on.
    """

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Builds the map's range table, which takes a second or two on a large map.

        Raises UserError when the map has no free space.
        """
        self._rng = rng
        self._lock = Lock()
        self._is_settled = self._is_narrow = False
        self._rival: Rival | None = None
        self._stretches, self._trust = OdometryStretches(), OdometryTrust()
        self._walls = find_walls(grid)
        self._survey(config)
        self._configure(config)
        self._motion = MotionSource(config)
        self._last: PoseEstimate | None = None
        self._published: _Published | None = None
        self._travel_since_weighing = self._seconds_since_weighing = 0.0
        self._scatter()

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None = None) -> None:
        """Start anew about a pose (3,), as widely as its covariance (3, 3) or else the settings say.

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            start = draw_start(map_from_base, covariance, self._free_space, self._config, self._rng)
            self._start_from(start)

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew from a point (2,) known to so many metres, facing any way.

        Raises UserError when the car cannot stand there or these are not finite numbers.
        """
        with self._lock:
            self._start_from(draw_within(radius, point_in_map, self._free_space, self._config, self._rng))

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._scatter()

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from the next scan on; the estimate goes on from where it is.

        Where the range table may take another amount of memory, it is built anew.
        """
        with self._lock:
            if config.table_megabytes != self._config.table_megabytes:
                self._survey(config)
            self._configure(config)
            self._motion.reconfigure(config)

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        self._motion.add(odometry)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            if self._last is not None and 0 <= self._last.stamp - scan.stamp < RESTART_SECONDS * 1e9:
                return replace(self._last, is_start=False)
            step = self._motion.step_to(scan.stamp)
            slip = self._config.slip
            self._filter.predict(step, self._motion.model, slip, self._trust.doubt(slip))
            if self._rival is not None:  # odometry has proven right only from a place that is in doubt now
                self._rival.filter.predict(step, self._motion.model, slip)
            if self._is_settled and step.is_over_gap:
                self._start_over(step)
            beams = select_beams(scan, self._config.beams, self._motion.poses_in_sweep)
            is_start = self._look(beams, step, scan.stamp) if len(beams) > 0 else not self._is_settled
            estimate = self._estimate(beams, step.seconds, scan.stamp, is_start)
            self._filter.resample(*self._wanted_particles(estimate))
            self._judge_odometry(step, estimate)
            self._motion.follow(scan.stamp, estimate.map_from_base)
            self._last = estimate
            self._published = _Published(estimate, self._motion.odom_from_base, self.odometry_faults)
            self._cloud = self._filter.map_from_base, self._filter.weights
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate carried to a stamp by odometry, its covariance grown; None before any scan."""
        published = self._published
        if published is None:
            return None
        last = published.estimate
        step = self._motion.step_from(published.odom_from_base, published.faults, last.stamp, stamp)
        map_from_base, covariance = carry(
            last.map_from_base, last.covariance, step.base_from_next_base, step.deviations
        )
        return replace(last, stamp=stamp, map_from_base=map_from_base, covariance=covariance, is_start=False)

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,) that sum to 1, as they were after the last scan or start."""
        map_from_base, weights = self._cloud
        return map_from_base.copy(), weights.copy()

    @property
    def odometry_faults(self) -> OdometryFaults:
        """What this car's odometry always gets wrong, as learned so far; all motion is corrected by it."""
        return self._motion.calibration.faults

    def _survey(self, config: LocalizationConfig) -> None:
        """Learn what the sensor would see from where on the map."""
        self._free_space = find_free_space(self._walls.grid, affordable_cells(config.table_megabytes))
        self._table = build_range_table(self._free_space, config.table_megabytes)
        self._search = PlaceSearch(self._free_space, self._table)
        self._lost = LostDetector(self._search.shares_when_lost())

    def _configure(self, config: LocalizationConfig) -> None:
        self._config = config
        self._sensor: SensorModel = (
            LikelihoodField(self._free_space, self._walls, config.squash)
            if config.sensor_model == "likelihood_field"
            else BeamModel(self._free_space, self._table, config.squash)
        )

    def _scatter(self) -> None:
        self._start_from(self._anywhere())
        self._search_near, self._search_far = False, True

    def _start_over(self, step: MotionStep) -> None:
        """Search where the odometry leads, and the whole map if the next scan does not fit there."""
        assert self._last is not None
        predicted = compose(self._last.map_from_base, step.base_from_next_base)
        self._start_from(draw_about(predicted, self._config.particles, self._config, self._rng))
        self._search_far = True

    def _anywhere(self) -> Pose:
        return draw_anywhere(self._free_space, self._config, self._rng)

    def _start_from(self, map_from_base: Pose) -> None:
        """Search among poses (N, 3) when the next scan comes."""
        self._filter = ParticleFilter(map_from_base, self._rng)
        self._cloud = self._filter.map_from_base, self._filter.weights
        self._search_near, self._search_far = True, False
        self._is_settled = False
        self._rival = None
        self._lost = self._lost.for_another_place()
        self._do_not_continue()

    def _do_not_continue(self) -> None:
        """The estimates to come do not continue those before: the car did not move by what lies between."""
        self._motion.forget_speed()
        self._stretches.start_anew()

    def _look(self, beams: Beams, step: MotionStep, stamp: int) -> bool:
        """Take in a scan; whether the estimates to come do not continue those before."""
        if not self._is_settled:
            self._settle(beams, stamp)
            return True
        self._travel_since_weighing += step.travel
        self._seconds_since_weighing += step.seconds
        is_news = self._travel_since_weighing >= _NEWS_AFTER
        if not is_news and self._seconds_since_weighing >= _LOOK_AGAIN_AFTER:
            self._filter.stray(_PUSHED)
            is_news = True
        if is_news:
            explained = self._explained(beams)
            log_likelihood = self._sensor.log_likelihood(self._filter.map_from_base, explained.beams)
            self._filter.weigh(explained.evidence * log_likelihood, self._travel_since_weighing)
        is_start = self._race(beams, is_news, step.seconds, stamp)
        if is_news:
            self._travel_since_weighing = self._seconds_since_weighing = 0.0
        return is_start

    def _explained(self, beams: Beams) -> Explanation:
        """What to weigh: while the cloud is narrow, only what the map explains.

        Where beams fit better beside the cloud, a few particles go there.
        """
        if not self._is_narrow:
            return Explanation(beams, 1.0, None)

        def align() -> Alignment:
            mean, covariance, _ = self._filter.moments()
            return refine(mean, covariance, beams, self._walls)

        explained = explain(beams, self._filter.map_from_base, align, self._sensor)
        if explained.better is not None:
            self._filter.propose(*explained.better)
        return explained

    def _settle(self, beams: Beams, stamp: int) -> None:
        """Take in a first scan, for which the cloud is too thin to be weighed at once."""
        self._is_settled = True
        self._travel_since_weighing = self._seconds_since_weighing = 0.0
        if not self._search_near:
            self._filter, _ = self._search_map(beams)
            return
        if not self._search_far:
            self._filter, _ = self._tempered(self._filter.map_from_base, beams, _FIRST_SCAN_COUNTS)
            return
        near, fit_near = self._tempered(self._filter.map_from_base, beams)
        if self._agrees(near.moments()[0], beams):
            self._filter = near
            return
        far, fit_far = self._search_map(beams)
        if fit_far - fit_near > _FAR_ADVANTAGE * len(beams) / self._config.squash:
            near, far = far, near
        self._filter, self._rival = near, Rival(far, self._lost.for_another_place(), stamp)

    def _race(self, beams: Beams, is_news: bool, seconds: float, stamp: int) -> bool:
        """Search for a rival when the car seems lost; it takes over once it has fitted better for a while."""
        rival = self._rival
        if self._lost.probability >= _DOUBTFUL and (rival is None or rival.has_failed(stamp)):
            found, _ = self._search_map(beams)
            self._rival = Rival(found, self._lost.for_another_place(), stamp)
            return False
        if rival is None:
            return False
        self._judge(rival.lost, rival.filter.moments()[0], beams, seconds)
        log_likelihood = self._sensor.log_likelihood(rival.filter.map_from_base, beams)
        if is_news:
            rival.filter.weigh(log_likelihood, self._travel_since_weighing)
            rival.filter.resample(self._config.particles, self._config.scattered_particles)
        fit = self._sensor.log_likelihood(self._filter.map_from_base, beams).max()
        rival.compare(float(log_likelihood.max() - fit), seconds * rival.lost.clarity, is_news)
        if self._lost.probability < _FOUND:
            self._rival = None
        elif rival.has_won:
            self._filter, self._lost, self._rival = rival.filter, rival.lost, None
            self._do_not_continue()
            return True
        return False

    def _search_map(self, beams: Beams) -> tuple[ParticleFilter, float]:
        found = self._search.find(beams, self._config.squash, self._config.scattered_particles, self._rng)
        return self._tempered(found, beams)

    def _tempered(self, cloud: Pose, beams: Beams, share: float = 1.0) -> tuple[ParticleFilter, float]:
        """Particles at the places of a cloud that fit a scan best, and the best one's log-likelihood.

        Of the scan's log-likelihood a share counts.
        """

        def log_likelihood(map_from_base: Pose) -> NDArray[np.float64]:
            return share * self._sensor.log_likelihood(map_from_base, beams)

        most = min(len(cloud), self._config.scattered_particles)
        fewest = min(self._config.fewest_particles, most)
        particles = temper(cloud, log_likelihood, fewest, most, self._rng)
        best = float(self._sensor.log_likelihood(particles, beams).max())
        return ParticleFilter(particles, self._rng), best

    def _estimate(self, beams: Beams, seconds: float, stamp: int, is_start: bool) -> PoseEstimate:
        map_from_base, covariance, weight = self._filter.moments()
        self._is_narrow = _is_known_within(_NARROW, covariance, weight)
        if _is_known_within(_TRACKED, covariance, weight):
            map_from_base, covariance = refine(map_from_base, covariance, beams, self._walls)
        self._judge(self._lost, map_from_base, beams, seconds)
        return PoseEstimate(
            stamp=stamp,
            map_from_base=map_from_base,
            covariance=covariance,
            cluster_weight=weight,
            effective_sample_size=self._filter.effective_size,
            particle_count=len(self._filter),
            is_start=is_start,
            lost_probability=1.0 - (1.0 - self._lost.probability) * weight,
        )

    def _agrees(self, map_from_base: Pose, beams: Beams) -> bool:
        """Whether the car is rather at a pose (3,) than elsewhere, by one scan."""
        shares = agreement_shares(map_from_base, beams, self._free_space)
        return shares is not None and self._lost.evidence(shares) < 0.0

    def _judge(self, lost: LostDetector, map_from_base: Pose, beams: Beams, seconds: float) -> None:
        """Tell a detector how a scan agrees with the map; from inside an obstacle nothing can be told."""
        shares = agreement_shares(map_from_base, beams, self._free_space)
        if shares is not None:
            lost.judge(shares, seconds)

    def _judge_odometry(self, step: MotionStep, estimate: PoseEstimate) -> None:
        """Compare the way that odometry tells with that of the estimates."""
        is_known = _is_known_within(_TRUSTED, estimate.covariance, estimate.cluster_weight)
        stretch = self._stretches.follow(step, self._filter.lag, estimate if is_known else None)
        if stretch is not None:
            self._trust.learn(stretch, self._config.slip)
            self._motion.calibration.learn(stretch, self._config.slip)

    def _wanted_particles(self, estimate: PoseEstimate) -> tuple[int, int]:
        """The fewest and the most."""
        if not _is_known_within(_TRACKED, estimate.covariance, estimate.cluster_weight):
            return min(len(self._filter), self._config.scattered_particles), len(self._filter)
        most = self._config.particles
        return min(self._config.fewest_particles, most), most


def _is_known_within(metres: float, covariance: NDArray[np.float64], cluster_weight: float) -> bool:
    return bool(cluster_weight > _DOMINANT and covariance[0, 0] + covariance[1, 1] < metres**2)
