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
from racecar.mapping.keyframes.constraints import TIED_TO
from racecar.mapping.keyframes.drive import Drive
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.session.session import Session, one_drive
from racecar.mapping.state.growth import Growth
from racecar.maps.geometry.se2 import Pose, adjoint, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.motion.calibration import MatchedSpans, calibrate
from racecar.sensors.motion.dead_reckoning import DeadReckoning


@dataclass(eq=False)
class MapperState:
    """Everything that a mapper knows; K keyframes so far."""

    config: MappingConfig
    reckoning: DeadReckoning
    keyframes: ScanStore
    loops: LoopCloser
    graph: PoseGraph
    drive: Drive
    map_from_keyframe: Pose = field(default_factory=lambda: np.zeros((0, 3)))
    """(K, 3); a keyframe's frame is that of the laser."""
    rays: list[Rays] = field(default_factory=list)
    """(K) of the keyframes."""
    steps: "array[float]" = field(default_factory=lambda: array("d"))
    """`measured_steps`, flat."""
    known_since: int = 0
    """The keyframe before which the car was elsewhere, where that is not known."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    clouds: dict[int, NDArray[np.float32]] | None = None
    """(N, 3) what a sensor with many rows saw, by keyframe; None where they were not asked for."""
    keyframe_lasers: "array[int]" = field(default_factory=lambda: array("B"))
    """Which laser took each keyframe, by number."""
    held_rays: dict[int, Rays] = field(default_factory=dict)
    """By scan, of those between the first keyframes, while these are so few that even what all of them see is
    not free yet."""

    @classmethod
    def begin(cls, config: MappingConfig, odometry_lag: int) -> "MapperState":
        """Of a drive that begins; ``odometry_lag`` in nanoseconds, as far as it is known."""
        keyframes = ScanStore()
        reckoning, loops = DeadReckoning(odometry_lag), LoopCloser(keyframes)
        return cls(config, reckoning, keyframes, loops, PoseGraph(), Drive())

    @property
    def map_from_reference(self) -> Pose:
        """(K, 3) the reference among the lasers at the keyframes."""
        return self.reckoning.mounts.to_reference(self.map_from_keyframe, self.keyframe_lasers)

    @property
    def last_map_from_reference(self) -> Pose:
        """(3,) the reference at the last keyframe that was placed."""
        placed = len(self.map_from_keyframe)
        lasers = self.keyframe_lasers[placed - 1 : placed]
        last: Pose = self.reckoning.mounts.to_reference(self.map_from_keyframe[-1:], lasers)[0]
        return last

    def keyframes_alike(self, index: int) -> NDArray[np.int64] | None:
        """(A,) the keyframes before ``index`` that the same laser took; None where there is only one."""
        lasers = np.array(self.keyframe_lasers[:index])
        alike = np.flatnonzero(lasers == self.keyframe_lasers[index])
        return None if self.reckoning.mounts.are_one else alike

    def guess_scans(self, scans: NDArray[np.int64], map_from_keyframe: Pose) -> Pose:
        """map_from_laser (M, 3) of some scans, by the keyframes (K, 3) and the motion since each."""
        mounts = self.reckoning.mounts
        guesses = self.drive.guess(scans, mounts.to_reference(map_from_keyframe, self.keyframe_lasers))
        return mounts.to_laser(guesses, np.array(self.drive.lasers)[scans].tolist())

    @property
    def last_keyframe_sees(self) -> bool:
        """Whether the last keyframe met anything; True where there is none."""
        return len(self.keyframes) == 0 or bool(self.keyframes.row_of[-1] > 0)

    @property
    def measured_steps(self) -> NDArray[np.float64]:
        """(K - 1, 6) from keyframe to keyframe: the motion as the wheels measured it and the turn as the
        gyroscope did, each NaN where it did not; the seconds; and 1 where the scans refuted the wheels."""
        return np.array(self.steps).reshape(-1, 6)

    @property
    def refuted_steps(self) -> NDArray[np.bool_]:
        """(K - 1,) in which the scans refuted the wheels."""
        return np.asarray(self.measured_steps[:, 5] > 0.0)

    def forget_frozen_wheels(self) -> None:
        """What wheels measured while they repeated a pose counts as not measured: that they did is known only
        once the scans show it, and along bare walls these show it late."""
        stamps, steps = self.drive.keyframe_stamps, self.measured_steps
        for stretch in self.reckoning.frozen.told:
            steps[(stamps[:-1] < stretch.end) & (stamps[1:] > stretch.begin), :3] = np.nan
        self.steps = array("d", steps.ravel().tolist())

    def calibrate(self, first: int) -> None:
        """Learn the wheels' errors from the keyframe steps from ``first`` on."""
        measured = self.measured_steps[first:]
        steps, (gyro_turns, seconds, are_refuted) = measured[:, :3].copy(), measured[:, 3:].T
        steps[are_refuted > 0.0] = np.nan
        self.reckoning.calibration = calibrate(
            steps,
            self._spans_since(first),
            lambda corrected: self.reckoning.fused(corrected, gyro_turns, seconds),
        )

    def _spans_since(self, first: int) -> MatchedSpans:
        """What scan matching measured along the path from a keyframe on, as motions of the reference."""
        edges, longest = self.graph.constraints.to_arrays(), max(TIED_TO)
        starts, ends = edges["keyframes"].astype(np.int64).T
        chosen = self.graph.constraints.are("scan_matching") & (starts >= first) & (ends - starts <= longest)
        starts, ends, motions = starts[chosen], ends[chosen], edges["poses"][chosen]
        lasers = np.array(self.keyframe_lasers)
        motions = self.reckoning.mounts.motions_of_reference(motions, lasers[starts], lasers[ends])
        return MatchedSpans(starts - first, ends - first, motions, edges["information"][chosen])

    def by_wheels(self, index: int, step: Pose, gyro_step: tuple[float, float]) -> Constraint:
        """What a ``step`` (3,) of the wheels says of keyframe ``index`` and the one before; the gyroscope
        measured a turn in so many seconds."""
        corrected = self.reckoning.corrected(step, *gyro_step)
        return self.by_motion(index, corrected, self.reckoning.calibration.information(corrected))

    def by_motion(self, index: int, step: Pose, information: NDArray[np.float64]) -> Constraint:
        """That the reference moved by a ``step`` (3,) between keyframe ``index`` and the one before; its
        ``information`` (3, 3) is in the tangent frame of the reference."""
        mounts = self.reckoning.mounts
        before, after = (mounts.of(laser) for laser in self.keyframe_lasers[index - 1 : index + 1])
        if before is not None:
            step = compose(inverse(before), step)
        if after is not None:
            step, to_reference = compose(step, after), adjoint(after)
            information = to_reference.T @ information @ to_reference
        return Constraint(index - 1, index, step, information, "odometry")

    def all_by_wheels(self) -> list[Constraint]:
        """The same of every step that they measured, also where scans refuted them."""
        return [
            self.by_wheels(index, measured[:3], (float(measured[3]), float(measured[4])))
            for index, measured in enumerate(self.measured_steps, start=1)
            if not np.isnan(measured[0])
        ]

    @contextmanager
    def undone_on_failure(self) -> Iterator[None]:
        """Where a keyframe fails within, nothing of it stays, so that all that grows with the keyframes stays
        of one length."""
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
        """How much is mapped so far."""
        graph, constraints = self.loops.history.graph, self.graph.constraints
        metres = graph.path[-1] if graph.path else 0.0
        return Growth(
            len(self.keyframes), len(graph.submaps), int(constraints.are("loop_closure").sum()), metres
        )

    def session(self) -> Session:
        """Everything so far but the scans between keyframes; it goes on growing with the mapper."""
        return Session(
            self.keyframes,
            self.rays,
            self.reckoning.mounts.laser_from_base(self.keyframe_lasers),
            self.map_from_keyframe,
            self.graph.constraints,
            self.loops.history,
            one_drive(len(self.keyframes)),
        )

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Adds the wall time within to that of a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start
