"""The mapper: one scan at a time, from odometry to an optimized map. The whole method is on this page."""

from collections.abc import Callable
from functools import partial
from threading import RLock

import numpy as np
from numpy.typing import NDArray

from racecar.mapping import schedule
from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.grid.log_odds import looks_until_free
from racecar.mapping.grid.rendering import Rays, pack_rays, rays_of
from racecar.mapping.keyframes.constraints import LOOKBACK, constrain, pairs_along_path
from racecar.mapping.keyframes.drive import SCANS_PER_KEYFRAME
from racecar.mapping.keyframes.final_optimization import mean_bend, rematched
from racecar.mapping.keyframes.gap import Gap, gap_after
from racecar.mapping.keyframes.placement import (
    MIN_SEARCH_POINTS,
    REFUTED_ODDS,
    SAME_GUESS,
    KeyframePlacer,
    Placement,
)
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.drawing import draw_map
from racecar.mapping.session.forgetting import forget_outdated
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session
from racecar.mapping.state.growth import Growth
from racecar.mapping.state.mapper_state import MapperState
from racecar.mapping.state.result import MappingResult, finished_map_of, result_of, views_of
from racecar.mapping.state.scan_poses import place_all_scans
from racecar.mapping.state.trimming import trim_known_keyframes, trim_scans
from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, adjoint, between, compose, inverse
from racecar.sensors.arrays import pose_or_nan
from racecar.sensors.matching.scan_store import prepare_scan
from racecar.sensors.motion.dead_reckoning import UNMEASURED
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.motion.lag import KnownLag
from racecar.sensors.motion.motion_guesses import AT_KEYFRAME, GuessSource, MotionGuesses
from racecar.sensors.motion.turn_fusion import TurnModel
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_DEFAULTS = MappingConfig()


class Mapper:
    """Builds a map incrementally from scans, odometry and yaw rates in time order.

    Other threads may read while one feeds it. They get a snapshot taken between two measurements, and wait
    while a scan is processed, which may take seconds when a loop is closed. If `add_scan` raises, that scan
    is dropped and the state is otherwise unchanged.
    """

    @checked
    def __init__(
        self, config: MappingConfig = _DEFAULTS, odometry_lag: int = 0, *, keep_clouds: bool = False
    ) -> None:
        """``odometry_lag`` is the known lag in nanoseconds; it is refined as the car turns. With
        ``keep_clouds`` the result contains the cloud of a multi-row sensor at each keyframe."""
        self._config = config
        self._state = MapperState.begin(config, odometry_lag)
        self._state.clouds = {} if keep_clouds else None
        self._lock = RLock()
        """Held while the state is changed or read."""

    def __getstate__(self) -> tuple[MappingConfig, MapperState]:
        """State to pickle between two measurements, for a copy that another process finishes."""
        return self._config, self._state

    def __setstate__(self, state: tuple[MappingConfig, MapperState]) -> None:
        self._config, self._state = state
        self._lock = RLock()

    @property
    def last_stamp(self) -> int | None:
        """Stamp of the last scan in nanoseconds."""
        with self._lock:
            stamps = self._state.drive.stamps
            return stamps[-1] if stamps else None

    @property
    def odometry_lag(self) -> KnownLag:
        """Learned lag of odometry stamps after scan stamps."""
        with self._lock:
            return self._state.reckoning.odometry_lag.known

    @property
    def frozen_odometry(self) -> FrozenOdometry:
        """When the odometry repeated a pose while the car moved on."""
        with self._lock:
            return self._state.reckoning.frozen.copy()

    @property
    def turn_model(self) -> TurnModel:
        """Learned errors of the turns by wheels and gyroscope."""
        with self._lock:
            return self._state.reckoning.turns.model

    @property
    def growth(self) -> Growth:
        """Size of the map so far."""
        with self._lock:
            return self._state.growth()

    def session(self) -> Session:
        """The session so far, without the scans between keyframes."""
        with self._lock:
            return self._state.session().frozen()

    def seen_so_far(self) -> tuple[list[Rays], Pose, tuple[list[Rays], Pose]]:
        """Input of `GrowingGrid`: rays of the keyframes (K), their poses (K, 3), and temporary rays."""
        with self._lock:
            state = self._state
            return list(state.rays), state.map_from_keyframe.copy(), self._held_scans()

    def _held_scans(self) -> tuple[list[Rays], Pose]:
        """Rays and poses (H, 3) of the most recent scans between the first keyframes; none once there are
        enough keyframes to show free space."""
        state = self._state
        if not state.held_rays:
            return [], np.zeros((0, 3))
        latest = list(state.held_rays)[-looks_until_free(self._config.rendering) :]
        rays = [state.held_rays[scan] for scan in latest]
        return rays, state.guess_scans(np.array(latest, dtype=np.int64), state.map_from_keyframe)

    def quality_so_far(self) -> Callable[[], MapQuality]:
        """A function that judges the current map, of at least one keyframe and without the final
        optimization; it may be called in any thread while this mapper goes on."""
        with self._lock:
            now = finished_map_of(self._state, self._state.session().frozen())
        return partial(judge, now, self._config.quality)

    @checked
    def add_odometry(self, odometry: Odometry) -> None:
        """Add a wheel odometry sample."""
        with self._lock:
            self._state.reckoning.add_odometry(odometry)

    @checked
    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample."""
        with self._lock:
            self._state.reckoning.add_yaw_rate(yaw_rate)

    @checked
    def add_scan(self, scan: Scan) -> Pose:
        """Add a scan; returns the current ``map_from_base`` (3,). Scans of further lasers, which may not
        overlap the first one's, are skipped while no wheels report the motion between them."""
        with self._lock:
            return self._take_scan(scan)

    def _take_scan(self, scan: Scan) -> Pose:
        state = self._state
        if not state.reckoning.can_follow(scan):
            return self._map_from_base(state.reckoning.guesses())
        with state.timed("scan odometry"):
            points, guesses = state.reckoning.advance(scan)
        distance, angle = self._config.keyframe_distance, self._config.keyframe_angle
        wheel_step, has_returns = state.reckoning.wheel_step(), len(points) > 0
        since_last = scan.stamp - (scan.stamp if self.last_stamp is None else self.last_stamp)
        unknown_for = state.reckoning.blind_for if wheel_step is None else since_last
        gap = gap_after(unknown_for, wheel_step, distance)
        is_new = state.reckoning.wheels_begin or (has_returns and not state.last_keyframe_has_returns)
        needs_keyframe = gap != Gap.NONE or guesses.reach(distance, angle) or is_new
        # While the laser is blind, keyframes follow the wheels; without wheels there is nothing to add.
        if self.last_stamp is None or (needs_keyframe and (has_returns or wheel_step is not None)):
            self._add_keyframe(scan, points, guesses, gap)
            return self._map_from_base(AT_KEYFRAME)
        if has_returns:
            self._hold(scan, points)
        state.drive.add(scan.stamp, points, guesses, scan.laser)
        return self._map_from_base(guesses)

    def _map_from_base(self, guesses: MotionGuesses) -> Pose:
        map_from_reference = compose(self._state.last_map_from_reference, guesses.best)
        return compose(map_from_reference, inverse(self._state.reckoning.mounts.base_from_reference))

    def finish(
        self,
        progress: Callable[[float], None] | None = None,
        earlier: EarlierMap | None = None,
        name: str = "",
    ) -> MappingResult:
        """Optimize the keyframes, refine every scan and render the grid.

        The session remembers the recording by its ``name``. With an ``earlier`` map, this drive extends it,
        and the result is in its frame. Raises UserError without any scan, and NotRecognizedError when the
        drive is not recognized on the earlier map.
        """
        with self._lock:
            return self._finish(progress or (lambda share: None), earlier, name)

    def _finish(
        self, report: Callable[[float], None], earlier: EarlierMap | None, name: str
    ) -> MappingResult:
        if self.last_stamp is None:
            raise UserError("There was no usable scan, so there is no map: check the topic of the scans.")
        if not self._state.keyframes.is_kept.any():
            raise UserError(
                f"Not one beam of {len(self._state.drive)} scans met anything, so there is no map: make sure "
                "that nothing covers the laser, that it works, and that range_min and range_max (or "
                "min_range and max_range of the settings) are right."
            )
        state, config = self._state, self._config
        with state.timed("optimization"):
            self._optimize_finally()
        session = state.session(name)
        if earlier is not None:
            with state.timed("merging"):
                session = merge(earlier, session)
                session = forget_outdated(session)
        report(0.3)
        map_from_laser = place_all_scans(state, session)
        report(0.8)
        with state.timed("rendering"):
            drawn = draw_map(
                views_of(state, session, map_from_laser),
                session.keyframes,
                config.resolution,
                config.rendering,
                keep_frame=earlier is not None,
            )
        if drawn.drawn_from_map is not None:
            session = session.moved(drawn.drawn_from_map)
            map_from_laser = compose(drawn.drawn_from_map, map_from_laser)
        quality = self._judge(session)  # last, since its sentences contain map coordinates
        report(1.0)
        return result_of(state, session, map_from_laser, drawn, quality)

    def _hold(self, scan: Scan, points: NDArray[np.float64]) -> None:
        """Keep the rays of a scan between keyframes while there are too few of these to show free space."""
        state, config = self._state, self._config
        most = len(state.keyframes) * SCANS_PER_KEYFRAME
        if len(state.keyframes) < looks_until_free(config.rendering) and len(state.held_rays) < most:
            state.held_rays[len(state.drive)] = rays_of(scan, points, config.rendering)

    def _add_keyframe(
        self, scan: Scan, points: NDArray[np.float64], guesses: MotionGuesses, gap: Gap
    ) -> None:
        state = self._state
        prepared = prepare_scan(points)
        # A laser without returns may be covered: its misses show no free space.
        rays = rays_of(scan, points, self._config.rendering) if len(points) else Rays.none()
        with state.rolled_back_on_error():
            index = state.keyframes.add(prepared)
            state.keyframe_lasers.append(scan.laser)
            state.rays.append(rays)
            if index == 0:
                state.map_from_keyframe = scan.base_from_laser[None].copy()
                step, right, is_matched = IDENTITY, guesses.sources[0], True
            else:
                step, right, placed = self._place(index, guesses, gap)
                is_matched = self._connect(index, step, placed)
                if placed.is_lost or (gap == Gap.DRIVEN and not is_matched):
                    state.known_since = index
            if state.clouds is not None and state.reckoning.cloud is not None:
                state.clouds[index] = state.reckoning.cloud.astype(np.float32)
            state.reckoning.start_keyframe(step, prepared, scan.laser, is_matched=is_matched and index > 0)
            state.drive.start_keyframe(guesses, right)
            state.drive.add(scan.stamp, points, AT_KEYFRAME, scan.laser)
        if len(state.keyframes) >= looks_until_free(self._config.rendering):
            state.held_rays.clear()
        try:
            self._learn_and_optimize(index, step)
        finally:  # the path must grow with the keyframes even on an error
            self._grow_submaps()
        self._trim(index)

    def _place(self, index: int, guesses: MotionGuesses, gap: Gap) -> tuple[Pose, GuessSource, Placement]:
        """Place a new keyframe; returns the motion (3,) of the reference since the last one, the guess that
        led there, and the placement."""
        state = self._state
        has_wheels = state.reckoning.wheel_step() is not None
        repeats = gap == Gap.NONE and state.reckoning.wheels_repeat
        can_refute = repeats or self._sees_much(index)
        if has_wheels and not can_refute:  # few returns fit anywhere, and wheels that turn do not hang
            guesses = guesses.first
        elif gap == Gap.DRIVEN:  # scan odometry is lost after a gap, if it ever could follow
            guesses = guesses.without(GuessSource.SCAN_ODOMETRY)
        poses, prior = state.map_from_keyframe, state.reckoning.prior(guesses.best)
        last = state.last_map_from_reference
        mount = state.reckoning.mounts.of(state.keyframe_lasers[index])
        here, guessed = last, compose(last, guesses.motions)
        if mount is not None:
            here, guessed = compose(last, mount), compose(guessed, mount)
            prior = adjoint(mount).T @ prior @ adjoint(mount)
        alike = state.keyframes_alike(index)
        placer = KeyframePlacer(index, state.keyframes, poses, here, prior, state.known_since, repeats, alike)
        with state.timed("scan matching"):
            placed = placer.place(guessed, gap)
        state.map_from_keyframe = np.concatenate([poses, placed.pose[None]])
        moved_to = placed.pose if mount is None else compose(placed.pose, inverse(mount))
        step, right = between(last, moved_to), guesses.sources[placed.guess]
        if gap == Gap.NONE and has_wheels and can_refute:
            state.reckoning.judge_repeating(step, right, SAME_GUESS)
        return step, right, placed

    def _connect(self, index: int, step: Pose, placed: Placement) -> bool:
        """Connect a new keyframe to earlier ones by scan matching, unless it is lost, and by the wheels,
        loosened if the scans refute them; returns whether scan matching succeeded. With neither, the ``step``
        (3,) to its placement connects it."""
        state = self._state
        constraints: list[Constraint] = []
        if not placed.is_lost:
            with state.timed("scan matching"):
                pairs = pairs_along_path(range(index, index + 1))
                constraints = constrain(pairs, state.map_from_keyframe, state.keyframes)
        is_matched = len(constraints) > 0
        if not is_matched and self._sees_much(index - 1) and self._sees_much(index):
            state.reckoning.doubt_standing()
        wheel_step, gyro_step = state.reckoning.wheel_step(), state.reckoning.gyro_step()
        is_refuted = placed.odds_against_first > (REFUTED_ODDS if is_matched else 0.0)
        if wheel_step is not None and (is_matched or not is_refuted):
            by_wheels = state.by_wheels(index, wheel_step, gyro_step)
            constraints.append(by_wheels.loosened(state.map_from_keyframe) if is_refuted else by_wheels)
        elif not is_matched:
            constraints.append(state.by_motion(index, step, UNMEASURED))
        state.steps.extend((*pose_or_nan(wheel_step), *gyro_step, is_refuted))
        for constraint in constraints:
            state.graph.add(constraint)
        return is_matched

    def _sees_much(self, index: int) -> bool:
        return len(self._state.keyframes.points_of(index)) >= MIN_SEARCH_POINTS

    def _learn_and_optimize(self, index: int, step: Pose) -> None:
        """From time to time, calibrate the wheels and optimize the most recent keyframes; the last one is a
        ``step`` (3,) from the one before."""
        state = self._state
        if index % schedule.LAG_INTERVAL == 0:
            state.reckoning.learn_lag()
        stretch = float(np.hypot(step[0], step[1])) / self._config.keyframe_distance
        if schedule.calibrates_at(index, stretch):
            state.calibrate(max(0, index - schedule.CALIBRATION_WINDOW))
        if index % schedule.WINDOW_INTERVAL == 0 and index > schedule.WINDOW:
            with state.timed("optimization"):
                first = index + 1 - schedule.WINDOW
                state.map_from_keyframe = state.graph.optimize_since(state.map_from_keyframe, first)

    def _grow_submaps(self) -> None:
        """Add the newest keyframe to the submaps, for loop closure now and in later drives."""
        state, steps = self._state, self._state.map_from_reference[-2:]
        distance = float(np.hypot(*(steps[-1, :2] - steps[0, :2])))
        if state.loops.history.graph.add_keyframe(distance) is None:
            return
        state.loops.learn_drift(state.map_from_keyframe, state.graph)
        if self._config.close_loops:
            self._close_loops()

    def _close_loops(self) -> None:
        """Search for the submap just completed in earlier ones."""
        state = self._state
        with state.timed("loop closure"):
            closures = state.loops.close(state.map_from_keyframe)
        if not closures:
            return
        with state.timed("optimization"):
            history = state.loops.history
            first_free = history.first_free(schedule.RECENT_LOOPS)
            state.map_from_keyframe = state.graph.close(
                closures, state.map_from_keyframe, history.graph.groups(), first_free
            )

    def _trim(self, index: int) -> None:
        """From time to time, drop what is no longer needed and compact the rest."""
        state = self._state
        if index % schedule.WINDOW_INTERVAL == 0:
            trim_scans(state, index)
        if index > 0 and index % schedule.PACKING_INTERVAL == 0:
            trim_known_keyframes(state, index)
            state.drive.pack_clouds()
            pack_rays(state.rays)
            state.reckoning.forget_old_scans()

    def _optimize_finally(self) -> None:
        """Match all pairs of keyframes again from their current poses, including the first pass through each
        place but not where scans are misled, and solve the whole graph. Repeat while this bends the path:
        better poses calibrate the wheels better, which improves the guesses.

        Matching starts from the online poses: optimizing before, wrong matches might outvote right loops.
        """
        state, config = self._state, self._config
        if len(state.keyframes) == 1:
            return
        state.forget_frozen_wheels()
        are_misled = np.zeros(len(state.keyframes) - 1, dtype=np.bool_)
        for nth in range(schedule.FINAL_ROUNDS):
            state.calibrate(0)
            known, before = are_misled, state.map_from_keyframe
            state.graph, poses, are_misled = rematched(
                state.graph,
                state.all_by_wheels(),
                state.refuted_steps,
                known,
                state.map_from_keyframe,
                state.keyframes,
                with_first_pass=config.close_loops,
            )
            is_known = np.array_equal(are_misled, known)
            state.map_from_keyframe = state.graph.optimize_finally(poses, are_near=is_known and nth > 0)
            if is_known and mean_bend(before, state.map_from_keyframe, max(LOOKBACK)) < schedule.SETTLED_BEND:
                break

    def _judge(self, session: Session) -> MapQuality:
        """The verdict on the map of a drive, given the ``session`` of all drives."""
        with self._state.timed("judging"):
            return judge(finished_map_of(self._state, session), self._config.quality)
