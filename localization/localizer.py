"""The localizer of a live car: odometry and scans in, poses out."""

from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.filter.start_poses import draw_about, draw_start, region_about
from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.range_table.range_table import affordable_cells, build_range_table
from racecar.localization.floor.region import ANYWHERE, Region
from racecar.localization.floor.usable_map import refuse_unusable
from racecar.localization.floor.walls import find_walls
from racecar.localization.odometry.calibration import OdometryFaults
from racecar.localization.odometry.motion_model_kernels import carry
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments import OdometrySegments
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hypothesis import PoseHypothesis
from racecar.localization.recovery.lost_detector import LostDetector, agreement_shares
from racecar.localization.recovery.moving_rival import MovingRival
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beam_skipping import Alignment, Explanation, explain
from racecar.localization.sensor.beams import Beams, select_beams
from racecar.localization.sensor.registry import SENSOR_MODELS
from racecar.localization.sensor.sensor_model import SensorModel
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.frozen_odometry import FrozenOdometry
from racecar.maps.sensing.gyro_buffer import GyroReading
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.turn_fusion import TurnModel
from racecar.maps.sensing.yaw_rate import YawRate


@dataclass(frozen=True, eq=False)
class _Published:
    """What one scan came to; replaced as a whole, so that readers neither wait nor see two scans mixed."""

    estimate: PoseEstimate
    odom_from_base: Pose | None
    """At the estimate's stamp; None without odometry."""
    by_gyro: GyroReading | None
    """At the same time; None without a gyroscope."""
    faults: OdometryFaults
    """Of the odometry, as known then."""


class Localizer:
    """Estimates the car's pose on a map; its methods may be called from several threads at once.

    `add_odometry`, `add_yaw_rate`, `pose_at` and `particles` do not wait for a scan that is being worked on.
    """

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Builds the map's range table, which takes a second or two on a large map.

        Raises UserError when the map has no free space or no walls, or seems to have one for the other.
        """
        self._rng = rng
        self._lock = Lock()
        self._is_initialized = self._is_narrow = False
        self._other: PoseHypothesis | None = None
        """The second hypothesis."""
        self._rival: MovingRival | None = None
        self._searched: Region | None = None
        """Where the next scan is sought; None when it is expected about the particles."""
        self._segments = OdometrySegments(config.odometry_segments)
        self._trust = OdometryTrust(config.odometry_trust)
        self._walls = find_walls(grid)
        self._survey(config)
        self._configure(config)
        self._motion = MotionSource(config)
        self._last: PoseEstimate | None = None
        self._published: _Published | None = None
        self._travel_since_weighing = self._seconds_since_weighing = 0.0
        self._search_first(ANYWHERE)

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None = None) -> None:
        """Start anew about a pose (3,), spread by its covariance (3, 3) or else by the settings.

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            start = draw_start(map_from_base, covariance, self._free_space, self._config, self._rng)
            self._start_from(start)

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew from anywhere within a radius (metres) of a point (2,), facing any way.

        Raises UserError when the car cannot stand there, or a number is not finite.
        """
        with self._lock:
            self._search_first(region_about(point_in_map, radius, self._free_space))

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._search_first(ANYWHERE)

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from the next scan on; the estimate goes on from where it is.

        Where the range table may take another amount of memory, it is built anew.
        """
        with self._lock:
            if _surveyed_with(config) != _surveyed_with(self._config):
                self._survey(config)
            self._configure(config)
            self._motion.reconfigure(config)
            self._segments.config = config.odometry_segments
            self._trust.config = config.odometry_trust
            self._filter.config = config.particle_filter
            if self._other is not None:
                self._other.filter.config = config.particle_filter

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        self._motion.add(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take in a sample of a gyroscope; those out of order are left out."""
        self._motion.add_yaw_rate(yaw_rate)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            if self._last is not None and self._is_out_of_order(scan.stamp, self._last.stamp):
                return replace(self._last, is_start=False)
            step = self._motion.step_to(scan.stamp)
            self._predict(step)
            if self._is_initialized and step.is_over_gap:
                self._start_over(step)
            beams = select_beams(scan, self._config.beams, self._motion.poses_in_sweep)
            is_start = self._update(beams, step) if len(beams) > 0 else not self._is_initialized
            is_start = self._moves_on(scan, step) or is_start
            estimate = self._estimate(beams, step.seconds, scan.stamp, is_start)
            if self._contest(beams, step.seconds, scan.stamp):
                estimate = self._estimate(beams, 0.0, scan.stamp, is_start=True)
            self._filter.resample(*self._wanted_particles(estimate))
            self._judge_odometry(step, estimate)
            self._motion.follow(scan.stamp, estimate.map_from_base)
            self._last = estimate
            self._published = _Published(
                estimate, self._motion.odom_from_base, self._motion.by_gyro, self.odometry_faults
            )
            self._cloud = self._filter.map_from_base, self._filter.weights
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate carried to a stamp by odometry, its covariance grown; None before any scan."""
        published = self._published
        if published is None:
            return None
        last = published.estimate
        step = self._motion.step_from(
            published.odom_from_base, published.faults, last.stamp, stamp, published.by_gyro
        )
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

    @property
    def frozen_odometry(self) -> FrozenOdometry:
        """When the odometry repeated a pose while the car moved on."""
        return self._motion.frozen

    @property
    def turn_model(self) -> TurnModel:
        """What the turns by wheels and gyroscope have proven to be worth so far."""
        return self._motion.turns.model

    def _survey(self, config: LocalizationConfig) -> None:
        """Learn what the sensor would see from where on the map."""
        affordable = affordable_cells(config.table_megabytes, config.range_table)
        self._free_space = find_free_space(self._walls.grid, affordable, config.free_space)
        refuse_unusable(self._walls, self._free_space, config.free_space)
        self._table = build_range_table(self._free_space, config.table_megabytes, config.range_table)
        self._places = PlaceSearch(self._free_space, self._table, config.place_search)
        shares_when_lost = self._places.shares_when_lost(config.lost_detector)
        self._lost = LostDetector(shares_when_lost, config.lost_detector)

    def _configure(self, config: LocalizationConfig) -> None:
        self._config = config
        make = SENSOR_MODELS[config.sensor_model]
        self._sensor: SensorModel = make(self._free_space, self._walls, self._table, config)

    def _filter_of(self, map_from_base: Pose) -> ParticleFilter:
        return ParticleFilter(map_from_base, self._rng, self._config.particle_filter)

    def _is_out_of_order(self, stamp: int, last: int) -> bool:
        """Whether a scan is older than the last one, but not because the clock was set back."""
        return 0 <= last - stamp < self._config.motion.restart_seconds * 1e9

    def _search_first(self, region: Region) -> None:
        """Start anew from anywhere in a region, which is searched when the next scan comes."""
        free_space = self._free_space.within(region)
        self._start_from(free_space.draw_poses(self._config.scattered_particles, self._rng))
        self._searched = region

    def _start_over(self, step: MotionStep) -> None:
        """Search where the odometry leads; if the scan does not fit there, the map is searched."""
        assert self._last is not None
        predicted = compose(self._last.map_from_base, step.base_from_next_base)
        self._start_from(draw_about(predicted, self._config.particles, self._config, self._rng))

    def _start_from(self, map_from_base: Pose) -> None:
        """Search among poses (N, 3) when the next scan comes."""
        self._filter = self._filter_of(map_from_base)
        self._cloud = self._filter.map_from_base, self._filter.weights
        self._searched = None
        self._is_initialized = False
        self._other = None
        self._lost = self._lost.for_another_place()
        self._do_not_continue()

    def _do_not_continue(self) -> None:
        """The estimates to come do not continue those before: the car did not move by what lies between."""
        self._motion.forget_speed()
        self._segments.start_anew()

    def _predict(self, step: MotionStep) -> None:
        """Move the particles by what odometry measured, or what the car is taken to have done."""
        slip = self._config.slip
        self._filter.predict(step, self._motion.model, slip, self._trust.slip_scale(slip))
        if self._other is not None:  # odometry has proven right only from a place that is in doubt now
            self._other.filter.predict(step, self._motion.model, slip)

    def _update(self, beams: Beams, step: MotionStep) -> bool:
        """Take in a scan; whether the estimates to come do not continue those before."""
        if not self._is_initialized:
            self._initialize(beams)
            return True
        self._travel_since_weighing += step.travel
        self._seconds_since_weighing += step.seconds
        is_news = self._is_news()
        if is_news:
            explained = self._explained(beams)
            log_likelihood = self._sensor.log_likelihood(self._filter.map_from_base, explained.beams)
            self._filter.weigh_next(explained.evidence * log_likelihood, self._travel_since_weighing)
            if self._other is not None:
                other = self._other.filter
                log_likelihood = self._sensor.log_likelihood(other.map_from_base, beams)
                other.weigh_next(log_likelihood, self._travel_since_weighing)
                other.resample(self._config.particles, self._config.scattered_particles)
            self._travel_since_weighing = self._seconds_since_weighing = 0.0
        return False

    def _moves_on(self, scan: Scan, step: MotionStep) -> bool:
        """Whether the odometry, which repeats one pose, hangs and the car goes on from elsewhere."""
        config, rival = self._config, self._rival
        if self._last is None or step.is_over_gap or not self._motion.repeats(scan.stamp):
            rival = None  # in a gap the car may have been carried, whatever its odometry does
        elif self._is_narrow and (rival is None or rival.has_failed):
            rival = MovingRival(self._last, self._motion.speed, config.moving_rival)
        self._rival = rival
        if rival is None:
            return False

        def poses_in_sweep(stamps: NDArray[np.int64]) -> Pose:
            return (stamps - scan.stamp)[:, None] * 1e-9 * rival.speed

        beams = select_beams(scan, config.beams, poses_in_sweep)
        rival.follow(
            step.seconds,
            lambda pose, covariance: refine(pose, covariance, beams, self._walls, config.alignment)[0],
            lambda poses: self._sensor.log_likelihood(poses, beams),
        )
        if not rival.has_won:
            return False
        self._motion.leave_out_odometry(scan.stamp, rival.speed)
        self._segments.start_anew()
        distance, angle = config.tracking.pushed_distance, config.tracking.pushed_angle
        pushed = np.array([distance, distance, angle])
        cloud = rival.map_from_base + pushed * self._rng.standard_normal((config.particles, 3))
        self._filter, self._rival = self._filter_of(cloud), None
        return True

    def _is_news(self) -> bool:
        """Whether a scan counts: the car has moved, or may have been moved unnoticed in the meantime."""
        tracking = self._config.tracking
        if self._travel_since_weighing >= tracking.news_after:
            return True
        if self._seconds_since_weighing < tracking.look_again_after:
            return False
        pushed = [tracking.pushed_distance, tracking.pushed_distance, tracking.pushed_angle]
        self._filter.inject(np.array(pushed))
        return True

    def _explained(self, beams: Beams) -> Explanation:
        """What to weigh: while the cloud is narrow, only what the map explains.

        Where beams fit better beside the cloud, a few particles go there.
        """
        if not self._is_narrow:
            return Explanation(beams, 1.0, None)

        def align() -> Alignment:
            mean, covariance, _ = self._filter.moments()
            return refine(mean, covariance, beams, self._walls, self._config.alignment)

        cloud = self._filter.map_from_base
        explained = explain(beams, cloud, align, self._sensor, self._config.beam_skipping)
        if explained.better is not None:
            self._filter.propose(*explained.better)
        return explained

    def _initialize(self, beams: Beams) -> None:
        """Take in a first scan, for which the cloud is too thin to be weighed at once."""
        self._is_initialized = True
        self._travel_since_weighing = self._seconds_since_weighing = 0.0
        if self._searched is not None:
            self._filter = self._search(beams, self._searched)
        else:
            share = self._config.tracking.first_scan_share
            self._filter = self._narrowed(self._filter.map_from_base, beams, share)

    def _contest(self, beams: Beams, seconds: float, stamp: int) -> bool:
        """Look for another place while the car seems lost; whether it has proven to be there.

        Of two places the one wins that scans confirm first.
        """
        config, other = self._config.hypothesis, self._other
        if len(beams) == 0:
            return False
        is_lost = self._lost.probability >= config.search_from
        if is_lost and (other is None or other.has_failed(stamp, config)):
            other = PoseHypothesis(self._search(beams), self._lost.for_another_place(), stamp)
        self._other = other
        if other is None:
            return False
        self._judge(other.lost, other.filter.moments()[0], beams, seconds)
        if self._lost.probability < config.confirmed_below:
            self._other = None
        elif other.is_confirmed(config):
            self._filter, self._lost, self._other = other.filter, other.lost, None
            self._do_not_continue()
            return True
        return False

    def _search(self, beams: Beams, region: Region = ANYWHERE) -> ParticleFilter:
        """Where in a region a scan fits."""
        count = self._config.scattered_particles
        found = self._places.find(beams, self._config.squash, count, self._rng, region)
        return self._narrowed(found, beams)

    def _narrowed(self, cloud: Pose, beams: Beams, share: float = 1.0) -> ParticleFilter:
        """Particles at the places of a cloud that fit a first scan.

        Of the scan's log-likelihood a share counts.
        """
        filter = self._filter_of(cloud)
        filter.weigh(share * self._sensor.log_likelihood(cloud, beams))
        most = min(len(cloud), self._config.scattered_particles)
        filter.resample(min(self._config.fewest_particles, most), most)
        distance, angle = self._config.tracking.first_scan_distance, self._config.tracking.first_scan_angle
        filter.spread(np.array([distance, distance, angle]))
        return filter

    def _estimate(self, beams: Beams, seconds: float, stamp: int, is_start: bool) -> PoseEstimate:
        map_from_base, covariance, weight = self._filter.moments()
        tracking = self._config.tracking
        self._is_narrow = self._is_known_within(tracking.narrow_within, covariance, weight)
        if self._is_known_within(tracking.tracked_within, covariance, weight):
            alignment = self._config.alignment
            map_from_base, covariance = refine(map_from_base, covariance, beams, self._walls, alignment)
        agreement = self._judge(self._lost, map_from_base, beams, seconds)
        return PoseEstimate(
            stamp=stamp,
            map_from_base=map_from_base,
            covariance=covariance,
            cluster_weight=weight,
            effective_sample_size=self._filter.effective_size,
            particle_count=len(self._filter),
            is_start=is_start,
            lost_probability=1.0 - (1.0 - self._lost.probability) * weight,
            agreement=agreement,
        )

    def _judge(
        self, lost: LostDetector, map_from_base: Pose, beams: Beams, seconds: float
    ) -> NDArray[np.float64] | None:
        """Let a detector judge how a scan agrees with the map; from inside an obstacle there is no saying.

        The shares (4,) by which it does.
        """
        shares = agreement_shares(map_from_base, beams, self._free_space, self._config.lost_detector)
        if shares is not None:
            lost.judge(shares, seconds)
        return shares

    def _judge_odometry(self, step: MotionStep, estimate: PoseEstimate) -> None:
        """Compare the path that odometry reports with that of the estimates."""
        trusted = self._config.tracking.trusted_within
        is_known = self._is_known_within(trusted, estimate.covariance, estimate.cluster_weight)
        self._motion.learn_turn(estimate.map_from_base if is_known and not estimate.is_start else None)
        segment = self._segments.follow(step, self._filter.lag, estimate if is_known else None)
        if segment is not None:
            self._trust.learn(segment, self._config.slip)
            self._motion.calibration.learn(segment, self._config.slip)

    def _wanted_particles(self, estimate: PoseEstimate) -> tuple[int, int]:
        """The fewest and the most."""
        tracked = self._config.tracking.tracked_within
        if not self._is_known_within(tracked, estimate.covariance, estimate.cluster_weight):
            return min(len(self._filter), self._config.scattered_particles), len(self._filter)
        most = self._config.particles
        return min(self._config.fewest_particles, most), most

    def _is_known_within(self, metres: float, covariance: NDArray[np.float64], cluster_weight: float) -> bool:
        is_dominant = cluster_weight > self._config.tracking.dominant
        return bool(is_dominant and covariance[0, 0] + covariance[1, 1] < metres**2)


def _surveyed_with(config: LocalizationConfig) -> tuple[object, ...]:
    """The settings on which what is derived from the map depends."""
    return (
        config.table_megabytes,
        config.free_space,
        config.range_table,
        config.place_search,
        config.lost_detector,
    )
