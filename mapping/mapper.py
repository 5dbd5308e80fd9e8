"""The mapper: one scan at a time, from odometry to an optimized map. The whole method is on this page."""

import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays, named, part_of, pose_or_nan
from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.grid.despeckling import despeckled
from racecar.mapping.grid.rendering import Rays, pack_rays, rays_of, render, returns_of
from racecar.mapping.keyframes.drive import Drive
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.keyframes.keyframe_tracking import TIED_TO, constrain, place, place_far, place_left_alone
from racecar.mapping.keyframes.known_places import ALL_HELD, ties_to_known
from racecar.mapping.keyframes.refinement import refine_scans
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.verifiers import verifiers
from racecar.mapping.matching.scan_store import ScanStore, prepare_scan
from racecar.mapping.odometry.calibration import calibrate
from racecar.mapping.odometry.dead_reckoning import DeadReckoning
from racecar.mapping.odometry.lag import OdometryLag
from racecar.mapping.session.merging import merge
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.maps.trajectory import Trajectory

_WINDOW = 40
_WINDOW_EVERY = 10
_GAP = 2_000_000_000
"""Nanoseconds without a scan, after which the car may have been moved by hand."""
_BLIND = 500_000_000
"""Nanoseconds without a scan, after which wheels that drove a way tell where to look."""
_LEARN_LAG_EVERY = 10
_CALIBRATE_EVERY = 50
_CALIBRATE_OVER = 1000
_CAN_BE_SAVED_EVERY = 100
"""Keyframes."""
_HELD_FOR = 200
"""Keyframes, until when one may be given up: loops are closed by then."""
_SCANS_HELD = 6000
"""Scans between keyframes, at most, that wait for the end of the drive to find their places; each keyframe
takes the room of two. Placed sooner, among keyframes that are as good as settled, they come out some tenths
of a millimetre worse."""
_LOOPS_NOT_TIED = 10
"""Loops closed since a keyframe, after which it is held where it is when the next one strains."""


Snapshot: TypeAlias = Callable[[], Arrays]
"""Packs what a mapper knew when it was taken."""


@dataclass(frozen=True, eq=False)
class MappingResult:
    """What a mapping run yields."""

    trajectory: Trajectory
    """One pose of the base per scan."""
    grid: OccupancyGrid
    points: NDArray[np.float32]
    """(N, 2) metres in the map: the returns of all keyframes."""
    map_from_keyframe: Pose
    """(K, 3) of the base at every keyframe, those of earlier drives first."""
    keyframe_indices: NDArray[np.int64]
    """(L,) scans that are keyframes: the last L of all keyframes."""
    constraints: list[Constraint]
    """Between the bases of keyframes."""
    session: Session
    """What a later drive needs to carry on the map."""
    seconds: dict[str, float]
    """Wall time by stage."""
    counts: dict[str, int]
    warnings: list[str]
    """Sentences for people."""


class Mapper:
    """Builds a map incrementally; scans and odometry come in the order of time."""

    def __init__(self, config: MappingConfig, odometry_lag: int = 0) -> None:
        """``odometry_lag`` in nanoseconds as far as it is known; it is learned as the car turns."""
        self._config = config
        self._reckoning = DeadReckoning(config.odometry, odometry_lag)
        self._graph = PoseGraph(config.graph)
        self._keyframes = ScanStore()
        active = verifiers(config.loops) if config.verify_loops else []
        self._loops = LoopCloser(self._keyframes, config.loops, active)
        self._drive = Drive()
        self._map_from_keyframe: Pose = np.zeros((0, 3))
        self._rays: list[Rays] = []
        self._wheel_steps = array("d")
        self._known_since = 0
        self._seconds: dict[str, float] = {}
        self._can_be_saved = False

    @property
    def can_be_saved(self) -> bool:
        """Does `to_arrays` tell all there is to know? It does after every hundredth keyframe, where what
        cannot be told is forgotten, whether anybody saves the rest or not."""
        return self._can_be_saved

    @property
    def last_stamp(self) -> int | None:
        """Nanoseconds, of the last scan."""
        return self._drive.stamps[-1] if self._drive.stamps else None

    @property
    def odometry_lag(self) -> OdometryLag:
        """By how much odometry is stamped later than scans, as far as it was learned."""
        return self._reckoning.odometry_lag

    def to_arrays(self) -> Arrays:
        """Everything so far; while `can_be_saved`, another mapper goes on from it to the same bits."""
        return self.snapshot()()

    def snapshot(self) -> Snapshot:
        """Everything so far, taken at once; packed when called, in any thread while this mapper goes on, for
        that takes seconds after a long drive.

        The arrays of `Session`, of `Drive` under ``drive.`` and of `DeadReckoning` under ``reckoning.``;
        ``wheel_steps`` (K - 1, 3) from keyframe to keyframe as the wheels measured them, NaN where they did
        not; ``known_since``, the keyframe before which the car was elsewhere; wall ``seconds`` (T,) of the
        ``stages`` (T,).
        """
        session, drive, wheel_steps = self.session().frozen(), self._drive.frozen(), self._measured_steps()
        rest = {
            **named("reckoning", self._reckoning.to_arrays()),
            "known_since": np.array(self._known_since),
            "stages": np.array(list(self._seconds), dtype=np.str_),
            "seconds": np.array(list(self._seconds.values())),
        }
        return lambda: {
            **session.to_arrays(),
            **named("drive", drive.to_arrays()),
            "wheel_steps": wheel_steps,
            **rest,
        }

    @classmethod
    def from_arrays(cls, config: MappingConfig, arrays: Arrays) -> "Mapper":
        """A mapper of the same settings that goes on from where another was. Raises KeyError when an array
        is missing."""
        mapper = cls(config)
        session = Session.from_arrays(arrays)
        mapper._keyframes, mapper._rays = session.keyframes, session.rays
        mapper._loops = replace(mapper._loops, store=session.keyframes, history=session.loops)
        mapper._map_from_keyframe = session.map_from_keyframe
        mapper._graph = PoseGraph(config.graph, session.constraints)
        mapper._drive = Drive.from_arrays(part_of("drive", arrays))
        mapper._reckoning = DeadReckoning.from_arrays(part_of("reckoning", arrays), config.odometry)
        mapper._wheel_steps = array("d", arrays["wheel_steps"].ravel().tolist())
        mapper._known_since = int(arrays["known_since"])
        mapper._seconds = dict(zip(arrays["stages"].tolist(), arrays["seconds"].tolist(), strict=True))
        mapper._can_be_saved = True
        return mapper

    def add_odometry(self, odometry: Odometry) -> None:
        """Take a sample of wheel odometry."""
        self._reckoning.add_odometry(odometry)

    def add_scan(self, scan: Scan) -> Pose:
        """Take a scan; returns ``map_from_base`` (3,) as known now."""
        with self._timed("scan odometry"):
            points = self._reckoning.advance(scan)
        guesses = self._reckoning.motions()
        self._can_be_saved = False
        is_after_gap = self._is_after_gap(scan)
        if self.last_stamp is None or is_after_gap or self._is_far(guesses):
            self._add_keyframe(scan, points, guesses, is_after_gap=is_after_gap)
            guesses = np.zeros((1, 3))
        self._drive.add(scan.stamp, points, guesses)
        map_from_laser = compose(self._map_from_keyframe[-1], guesses[0])
        return compose(map_from_laser, inverse(self._reckoning.base_from_laser))

    def finish(
        self, progress: Callable[[float], None] | None = None, earlier: Session | None = None
    ) -> MappingResult:
        """Settle the keyframes, refine every scan and render the grid.

        With an ``earlier`` session this drive carries on its map, and the result lies in its frame. Raises
        UserError without any scan, and when the drive is not recognized anywhere on the earlier map.
        """
        if len(self._drive) == 0:
            raise UserError(
                "There was no usable scan, so there is no map; `racecar check` tells what a bag holds."
            )
        report = progress or (lambda share: None)
        with self._timed("optimization"):
            self._settle()
        session = self.session()
        if earlier is not None:
            with self._timed("merging"):
                session = merge(
                    earlier, session, self._loops, self._config.place_recognition, self._config.graph
                )
        report(0.3)
        map_from_laser = self._place_scans(session)
        report(0.8)
        with self._timed("rendering"):
            returns = returns_of(session.rays, session.map_from_keyframe)
            grid = render(
                session.rays, session.map_from_keyframe, self._config.resolution, self._config.rendering
            )
            grid = despeckled(grid, returns, self._config.despeckling)
        report(1.0)
        map_from_base = compose(map_from_laser, inverse(self._reckoning.base_from_laser))
        return MappingResult(
            trajectory=Trajectory(np.array(self._drive.stamps, dtype=np.int64), map_from_base),
            grid=grid,
            points=np.concatenate(returns).astype(np.float32),
            map_from_keyframe=compose(session.map_from_keyframe, session.keyframe_from_base),
            keyframe_indices=np.array(self._drive.keyframe_scans, dtype=np.int64),
            constraints=list(session.constraints_between_bases()),
            session=session,
            seconds=dict(self._seconds),
            counts=self._counts(session),
            warnings=self._warnings(),
        )

    def _place_scans(self, session: Session) -> Pose:
        """map_from_laser (N, 3) of every scan, among the keyframes of all drives."""
        first = len(session.keyframes) - len(self._keyframes)
        map_from_laser = self._drive.guess(np.arange(len(self._drive)), session.map_from_keyframe[first:])
        map_from_laser[np.array(self._drive.keyframe_scans)] = session.map_from_keyframe[first:]
        held = self._drive.held_scans
        map_from_laser[held] = self._refined(held, map_from_laser[held], session)
        return map_from_laser

    def _refined(self, scans: NDArray[np.int64], guesses: Pose, session: Session) -> Pose:
        """Where scans (M,) that are guessed to lie at (M, 3) lie among the keyframes (M, 3).

        Without refinement it is where they are guessed to lie.
        """
        if not self._config.refine:
            return guesses
        first = len(session.keyframes) - len(self._keyframes)
        with self._timed("refinement"):
            return refine_scans(
                [self._drive.clouds[scan] for scan in scans],
                first + self._drive.keyframe_of(scans),
                guesses,
                session.keyframes,
                session.map_from_keyframe,
            )

    def _is_after_gap(self, scan: Scan) -> bool:
        """May what a scan shows be too far from what the last one did to be sought there?"""
        if self.last_stamp is None:
            return False
        blind = scan.stamp - self.last_stamp
        return blind > _GAP or (blind > _BLIND and self._has_driven())

    def _is_far(self, guesses: Pose) -> bool:
        """Has the laser left the last keyframe, by the wheels or by the scans?"""
        measured = guesses[:-1]
        distances, angles = np.hypot(measured[:, 0], measured[:, 1]), np.abs(measured[:, 2])
        return bool(
            distances.max() >= self._config.keyframe_distance or angles.max() >= self._config.keyframe_angle
        )

    def _add_keyframe(
        self, scan: Scan, points: NDArray[np.float64], guesses: Pose, *, is_after_gap: bool
    ) -> None:
        prepared = prepare_scan(points)
        index = self._keyframes.add(prepared)
        step, chosen, is_tied = IDENTITY, 0, True
        if index == 0:
            self._map_from_keyframe = self._reckoning.base_from_laser[None].copy()
        else:
            step, chosen = self._place(index, guesses, is_after_gap=is_after_gap)
            is_tied = self._tie(index, step, is_after_gap=is_after_gap)
            if is_after_gap and not is_tied and self._has_driven():
                self._known_since = index
        self._drive.start_keyframe(guesses, chosen)
        self._rays.append(rays_of(scan, points, self._config.rendering))
        self._reckoning.start_keyframe(step, prepared)
        if index % _LEARN_LAG_EVERY == 0:
            self._reckoning.learn_lag()
        if index % _CALIBRATE_EVERY == 0:
            self._calibrate(max(0, index - _CALIBRATE_OVER))
        if index % _WINDOW_EVERY == 0 and index > _WINDOW:
            with self._timed("optimization"):
                first = index + 1 - _WINDOW
                self._map_from_keyframe = self._graph.optimize_since(self._map_from_keyframe, first)
        if self._config.close_loops:
            self._close_loops(is_tied=is_tied)
        if index % _WINDOW_EVERY == 0:
            self._give_up_scans_before(index - _HELD_FOR)
        if index > 0 and index % _CAN_BE_SAVED_EVERY == 0:
            self._give_up_known(index - _HELD_FOR)
            self._drive.pack_clouds()
            pack_rays(self._rays)
            self._forget_what_cannot_be_saved()

    def _give_up_known(self, until: int) -> None:
        """Of the last keyframes before one, give up those whose place earlier ones show well enough."""
        first = max(until - _CAN_BE_SAVED_EVERY, 0)
        candidates = np.arange(first, max(until, 0))
        if (
            len(candidates) == 0
            or np.sum(self._keyframes.is_kept) <= ALL_HELD
            or not self._loops.history.submaps
        ):
            return
        with self._timed("scan matching"):
            ties = ties_to_known(candidates, self._map_from_keyframe, self._loops)
        if not ties:
            return
        with self._timed("optimization"):
            for tie in ties:
                self._graph.add(tie)
            settled = self._graph.optimize_since(self._map_from_keyframe[:until], first)
            last_from_later = between(self._map_from_keyframe[until - 1], self._map_from_keyframe[until:])
            self._map_from_keyframe = np.concatenate([settled, compose(settled[-1], last_from_later)])
        self._give_up(np.array([tie.to_keyframe for tie in ties]))
        self._graph.trim(self._keyframes.is_kept, first)

    def _give_up(self, keyframes: NDArray[np.int64]) -> None:
        """Forget what some keyframes saw, and the scans after each."""
        held = self._drive.held_scans
        self._give_up_scans(held[np.isin(self._drive.keyframe_of(held), keyframes)])
        self._keyframes.trim(keyframes)
        for keyframe in keyframes.tolist():
            self._rays[keyframe] = Rays.none()

    def _give_up_scans_before(self, until: int) -> None:
        """Of the scans between keyframes, give up those for which there is no room, the earliest first. Where
        keyframes are to be given up, so are those of the latest: hundreds would go with them at once."""
        held, keyframes_held = self._drive.held_scans, int(np.sum(self._keyframes.is_kept))
        keyframes = self._drive.keyframe_of(held)
        too_many = max(len(held) - max(_SCANS_HELD - 2 * keyframes_held, 0), 0)
        goes = keyframes < np.append(keyframes, until)[too_many]
        if keyframes_held > ALL_HELD:
            goes |= keyframes >= until - _WINDOW_EVERY
        self._give_up_scans(held[goes & (keyframes < until)])

    def _give_up_scans(self, scans: NDArray[np.int64]) -> None:
        """Forget what some scans between keyframes saw, once they have found their places."""
        if len(scans) == 0:
            return
        guesses = self._drive.guess(scans, self._map_from_keyframe)
        placed = self._refined(scans, guesses, self.session())
        self._drive.give_up(scans, placed, self._map_from_keyframe)

    def _forget_what_cannot_be_saved(self) -> None:
        self._reckoning.restart_scan_odometry()
        self._loops.forget_pyramids()
        self._can_be_saved = True

    def session(self) -> Session:
        """Everything so far but the scans between keyframes; it goes on growing with the mapper."""
        return Session(
            self._keyframes,
            self._rays,
            np.tile(inverse(self._reckoning.base_from_laser), (len(self._keyframes), 1)),
            self._map_from_keyframe,
            self._graph.constraints,
            self._loops.history,
        )

    def _place(self, index: int, guesses: Pose, *, is_after_gap: bool) -> tuple[Pose, int]:
        """Place a new keyframe in the map; returns its pose (3,) seen from the one before, and which guess
        led there."""
        last = self._map_from_keyframe[-1]
        known = (self._reckoning.calibration.worth, self._keyframes, self._map_from_keyframe)
        with self._timed("scan matching"):
            if not is_after_gap:
                placed, chosen = place(index, compose(last, guesses), *known, self._known_since)
            elif self._has_driven():
                placed, chosen = place_far(index, compose(last, guesses), *known)
            else:
                placed, chosen = place_left_alone(index, compose(last, guesses), *known, self._known_since)
        self._map_from_keyframe = np.concatenate([self._map_from_keyframe, placed[None]])
        return between(last, placed), chosen

    def _has_driven(self) -> bool:
        """Do the wheels tell of a way since the last keyframe, longer than there may be between two?"""
        step = self._reckoning.wheel_step()
        return step is not None and bool(np.hypot(step[0], step[1]) > 2.0 * self._config.keyframe_distance)

    def _tie(self, index: int, step: Pose, *, is_after_gap: bool) -> bool:
        """Connect a new keyframe to those before; tells whether scan matching did so.

        What the wheels say of a gap counts only where they drove and the scans tell nothing: the car may have
        been carried. With neither, the ``step`` (3,) to where it was placed holds it.
        """
        with self._timed("scan matching"):
            pairs = np.array([(index - back, index) for back in TIED_TO if back <= index])
            constraints = constrain(pairs, self._map_from_keyframe, self._keyframes)
        is_tied = len(constraints) > 0
        do_wheels_count = not is_after_gap or (self._has_driven() and not is_tied)
        wheel_step = self._reckoning.wheel_step() if do_wheels_count else None
        if wheel_step is not None:
            constraints.append(self._odometry_constraint(index, wheel_step))
        elif is_after_gap and not is_tied:
            information = self._reckoning.calibration.information(np.zeros(3))
            constraints.append(Constraint(index - 1, index, step, information, "odometry"))
        self._wheel_steps.extend(pose_or_nan(wheel_step))
        for constraint in constraints:
            self._graph.add(constraint)
        return is_tied

    def _odometry_constraint(self, index: int, step: Pose) -> Constraint:
        calibration = self._reckoning.calibration
        corrected = calibration.correct(step)
        matched = between(self._map_from_keyframe[index - 1], self._map_from_keyframe[index])
        information = calibration.information(between(corrected, matched))
        return Constraint(index - 1, index, corrected, information, "odometry")

    def _close_loops(self, *, is_tied: bool) -> None:
        steps = self._map_from_keyframe[-2:]
        distance = float(np.hypot(*(steps[-1, :2] - steps[0, :2])))
        if self._loops.add_keyframe(distance, is_matched=is_tied) is None:
            return
        with self._timed("loop closure"):
            closures = self._loops.close(self._map_from_keyframe)
        if not closures:
            return
        with self._timed("optimization"):
            history = self._loops.history
            self._map_from_keyframe = self._graph.close(
                closures,
                self._map_from_keyframe,
                history.graph.groups(),
                history.tied_until(_LOOPS_NOT_TIED),
            )

    def _calibrate(self, first: int) -> None:
        """Learn the wheels' errors from the keyframe steps from ``first`` on."""
        measured = self._measured_steps()
        known = first + np.flatnonzero(~np.isnan(measured[first:, 0]))
        matched = between(self._map_from_keyframe[known], self._map_from_keyframe[1:][known])
        self._reckoning.calibration = calibrate(measured[known], matched, self._config.odometry.calibration)

    def _measured_steps(self) -> Pose:
        """(K - 1, 3) from keyframe to keyframe as the wheels measured them, NaN where they did not."""
        return np.array(self._wheel_steps).reshape(-1, 3)

    def _settle(self) -> None:
        """Match all pairs of keyframes once more from where they are now, also with those of the first pass
        through each place, and solve the whole graph."""
        if len(self._keyframes) == 1:
            return
        self._map_from_keyframe = self._graph.optimize_roughly(self._map_from_keyframe)
        self._calibrate(0)
        graph = PoseGraph(self._config.graph)
        is_held = self._keyframes.is_kept
        every = range(len(is_held))
        pairs = np.array([(i - back, i) for i in every for back in TIED_TO if back <= i])
        pairs = pairs[is_held[pairs].all(axis=1)]
        for constraint in constrain(pairs, self._map_from_keyframe, self._keyframes):
            graph.add(constraint)
        for i, step in enumerate(self._measured_steps()):
            if not np.isnan(step[0]):
                graph.add(self._odometry_constraint(i + 1, step))
        # One that nothing ties now would be free to go anywhere; what has held it so far still does. So it is
        # with scans that were given up and cannot be matched any more.
        tied = {constraint.to_keyframe for constraint in graph.constraints}
        for c in self._graph.constraints:
            is_match_given_up = (
                c.kind == "scan_matching" and not is_held[[c.from_keyframe, c.to_keyframe]].all()
            )
            if c.kind == "loop_closure" or c.to_keyframe not in tied or is_match_given_up:
                graph.add(c)
        if self._config.close_loops:
            passes = pairs_with_first_pass(self._map_from_keyframe, is_held)
            for constraint in constrain(passes, self._map_from_keyframe, self._keyframes):
                graph.add(constraint)
        self._graph = graph
        self._map_from_keyframe = graph.optimize_finally(self._map_from_keyframe)

    def _counts(self, session: Session) -> dict[str, int]:
        constraints = session.constraints
        return {
            "scans": len(self._drive),
            "keyframes": len(session.keyframes),
            "keyframes_held": int(np.sum(session.keyframes.is_kept)),
            "keyframes_of_earlier_drives": len(session.keyframes) - len(self._keyframes),
            "scan_matching_constraints": int(constraints.are("scan_matching").sum()),
            "odometry_constraints": int(constraints.are("odometry").sum()),
            "loop_closures": int(constraints.are("loop_closure").sum()),
            "scans_without_odometry": self._reckoning.scans_without_odometry,
            **{f"loops_{name}": count for name, count in session.loops.log.items()},
        }

    def _warnings(self) -> list[str]:
        warnings = []
        if self._reckoning.scans_without_odometry == len(self._drive):
            warnings.append(
                "There was no wheel odometry: lengths of bare corridors are not to be trusted, "
                "and fast turns may have been lost."
            )
        if lag := self.odometry_lag.nanoseconds:
            where = "behind" if lag > 0 else "ahead of"
            warnings.append(
                f"By their stamps the odometry is {abs(lag) / 1e6:.0f} ms {where} the scans; "
                "the map was made as if it were not."
            )
        return warnings

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self._seconds[stage] = self._seconds.get(stage, 0.0) + time.perf_counter() - start
