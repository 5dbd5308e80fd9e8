"""The map under construction."""

import time
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.keyframes.constraints import LOOKBACK
from racecar.mapping.keyframes.drive import Drive
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.session.recordings import KeyframeTimes, Recording
from racecar.mapping.session.session import Session
from racecar.mapping.state.growth import Growth
from racecar.maps.geometry.se2 import Pose, adjoint, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.motion.calibration import MatchedSpans, calibrate
from racecar.sensors.motion.dead_reckoning import DeadReckoning


@dataclass(eq=False)
class MapperState:
    """The complete state of a mapper with K keyframes."""

    config: MappingConfig
    reckoning: DeadReckoning
    keyframes: ScanStore
    loops: LoopCloser
    graph: PoseGraph
    drive: Drive
    map_from_keyframe: Pose = field(default_factory=lambda: np.zeros((0, 3)))
    """(K, 3) poses; a keyframe's frame is the laser's."""
    rays: list[Rays] = field(default_factory=list)
    """(K) rays of the keyframes."""
    steps: "array[float]" = field(default_factory=lambda: array("d"))
    """`measured_steps`, flat."""
    known_since: int = 0
    """First keyframe since the car was last lost; its pose relative to earlier ones is unknown."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    clouds: dict[int, NDArray[np.float32]] | None = None
    """(N, 3) points of a multi-row sensor by keyframe; None if not requested."""
    keyframe_lasers: "array[int]" = field(default_factory=lambda: array("B"))
    """Laser index of each keyframe."""
    held_rays: dict[int, Rays] = field(default_factory=dict)
    """Rays of scans between the first keyframes, by scan, while there are too few keyframes to show any free
    space."""

    @classmethod
    def begin(cls, config: MappingConfig, odometry_lag: int) -> "MapperState":
        """Start a drive; ``odometry_lag`` is the known lag in nanoseconds."""
        keyframes = ScanStore()
        reckoning, loops = DeadReckoning(odometry_lag), LoopCloser(keyframes)
        return cls(config, reckoning, keyframes, loops, PoseGraph(), Drive())

    @property
    def map_from_reference(self) -> Pose:
        """(K, 3) poses of the reference laser at the keyframes."""
        return self.reckoning.mounts.to_reference(self.map_from_keyframe, self.keyframe_lasers)

    @property
    def last_map_from_reference(self) -> Pose:
        """(3,) pose of the reference laser at the last placed keyframe."""
        placed = len(self.map_from_keyframe)
        lasers = self.keyframe_lasers[placed - 1 : placed]
        last: Pose = self.reckoning.mounts.to_reference(self.map_from_keyframe[-1:], lasers)[0]
        return last

    def keyframes_alike(self, index: int) -> NDArray[np.int64] | None:
        """(A,) keyframes before ``index`` of the same laser; None if there is only one laser."""
        lasers = np.array(self.keyframe_lasers[:index])
        alike = np.flatnonzero(lasers == self.keyframe_lasers[index])
        return None if self.reckoning.mounts.are_one else alike

    def guess_scans(self, scans: NDArray[np.int64], map_from_keyframe: Pose) -> Pose:
        """Dead-reckoned map_from_laser (M, 3) of some scans, given the keyframes (K, 3)."""
        mounts = self.reckoning.mounts
        guesses = self.drive.guess(scans, mounts.to_reference(map_from_keyframe, self.keyframe_lasers))
        return mounts.to_laser(guesses, np.array(self.drive.lasers)[scans].tolist())

    @property
    def last_keyframe_has_returns(self) -> bool:
        """Whether the last keyframe has returns; True if there is none."""
        return len(self.keyframes) == 0 or bool(self.keyframes.row_of[-1] > 0)

    @property
    def measured_steps(self) -> NDArray[np.float64]:
        """(K - 1, 6) steps between keyframes: motion by wheels and turn by gyroscope, NaN where not measured;
        seconds; and 1 where the scans refuted the wheels."""
        return np.array(self.steps).reshape(-1, 6)

    @property
    def refuted_steps(self) -> NDArray[np.bool_]:
        """(K - 1,) steps in which the scans refuted the wheels."""
        return np.asarray(self.measured_steps[:, 5] > 0.0)

    def forget_frozen_wheels(self) -> None:
        """Discard wheel steps while a pose was repeated. This is known only once the scans show it, which
        along bare walls is late."""
        stamps, steps = self.drive.keyframe_stamps, self.measured_steps
        for stretch in self.reckoning.frozen.told:
            steps[(stamps[:-1] < stretch.end) & (stamps[1:] > stretch.begin), :3] = np.nan
        self.steps = array("d", steps.ravel().tolist())

    def calibrate(self, first: int) -> None:
        """Calibrate the wheels on keyframe steps from ``first`` on."""
        measured = self.measured_steps[first:]
        steps, (gyro_turns, seconds, are_refuted) = measured[:, :3].copy(), measured[:, 3:].T
        steps[are_refuted > 0.0] = np.nan
        self.reckoning.calibration = calibrate(
            steps,
            self._spans_since(first),
            lambda corrected: self.reckoning.fused(corrected, gyro_turns, seconds),
        )

    def _spans_since(self, first: int) -> MatchedSpans:
        """Scan matches along the path from a keyframe on, as motions of the reference."""
        edges, longest = self.graph.constraints.to_arrays(), max(LOOKBACK)
        starts, ends = edges["keyframes"].astype(np.int64).T
        chosen = self.graph.constraints.are("scan_matching") & (starts >= first) & (ends - starts <= longest)
        starts, ends, motions = starts[chosen], ends[chosen], edges["poses"][chosen]
        lasers = np.array(self.keyframe_lasers)
        motions = self.reckoning.mounts.motions_of_reference(motions, lasers[starts], lasers[ends])
        return MatchedSpans(starts - first, ends - first, motions, edges["information"][chosen])

    def by_wheels(self, index: int, step: Pose, gyro_step: tuple[float, float]) -> Constraint:
        """Wheel constraint of a ``step`` (3,) between keyframe ``index`` and the one before; the gyroscope
        measured a turn over a time in seconds."""
        corrected = self.reckoning.corrected(step, *gyro_step)
        return self.by_motion(index, corrected, self.reckoning.calibration.information(corrected))

    def by_motion(self, index: int, step: Pose, information: NDArray[np.float64]) -> Constraint:
        """Constraint that the reference moved by a ``step`` (3,) between keyframe ``index`` and the one
        before; its ``information`` (3, 3) is in the tangent frame of the reference."""
        mounts = self.reckoning.mounts
        before, after = (mounts.of(laser) for laser in self.keyframe_lasers[index - 1 : index + 1])
        if before is not None:
            step = compose(inverse(before), step)
        if after is not None:
            step, to_reference = compose(step, after), adjoint(after)
            information = to_reference.T @ information @ to_reference
        return Constraint(index - 1, index, step, information, "odometry")

    def all_by_wheels(self) -> list[Constraint]:
        """Wheel constraints of all measured steps, including refuted ones."""
        return [
            self.by_wheels(index, measured[:3], (float(measured[3]), float(measured[4])))
            for index, measured in enumerate(self.measured_steps, start=1)
            if not np.isnan(measured[0])
        ]

    @contextmanager
    def rolled_back_on_error(self) -> Iterator[None]:
        """Roll back a keyframe that fails inside the block, so that everything indexed by keyframes keeps the
        same length."""
        count, constraints = len(self.keyframes), len(self.graph.constraints)
        poses, known_since, steps = self.map_from_keyframe, self.known_since, len(self.steps)
        try:
            yield
        except BaseException:
            self.keyframes.cut(count)
            self.graph.constraints.cut(constraints)
            del self.keyframe_lasers[count:], self.rays[count:], self.steps[steps:]
            self.map_from_keyframe, self.known_since = poses, known_since
            if self.clouds is not None:
                self.clouds.pop(count, None)
            raise

    def growth(self) -> Growth:
        """Size of the map so far."""
        graph, constraints = self.loops.history.graph, self.graph.constraints
        metres = graph.path[-1] if graph.path else 0.0
        return Growth(
            len(self.keyframes), len(graph.submaps), int(constraints.are("loop_closure").sum()), metres
        )

    def session(self, name: str = "") -> Session:
        """The session so far, without scans between keyframes, of a recording with this name; it shares data
        and grows with the mapper."""
        stamps = self.drive.stamps or [0]
        recording = Recording(name, stamps[0], stamps[-1])
        return Session(
            self.keyframes,
            self.rays,
            self.reckoning.mounts.laser_from_base(self.keyframe_lasers),
            self.map_from_keyframe,
            self.graph.constraints,
            self.loops.history,
            KeyframeTimes.of(recording, self.drive.keyframe_stamps),
        )

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the wall time of the block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start
