"""A session: the data of earlier drives that a later one needs to extend their map.

Its arrays; K keyframes, R recordings, C constraints, S submaps, E edges,
H hypotheses:

============================  ==================  ============================================================
name                          shape, type         meaning
============================  ==================  ============================================================
keyframe_from_base            (K, 3) float64      inverse of the laser's mount on the car: metres, radians
map_from_keyframe             (K, 3) float64      poses of the laser in the map: metres, radians
times.stamps                  (K,) int64          nanoseconds: stamp of each keyframe's scan
times.recordings              (K,) int32          number of each keyframe's recording
times.names                   (R,) text           name of each recording
times.spans                   (R, 2) int64        nanoseconds: stamps of its first and last scan
times.drives                  (R,) int32          its rank in time
scans.counts                  (K,) int16          number of points of each keyframe; 0 if trimmed
scans.points                  (sum, 2) float32    metres in the laser frame, ascending in bearing
scans.normals                 (sum, 2) float32    unit vectors towards the laser; (0, 0) for none
rays.lengths                  (K,) int64          number of rays of each keyframe; likewise
rays.returns                  (K,) int64          number of returns among them; these come first
rays.ends                     (sum, 2) float32    metres in the laser frame
constraints.keyframes         (C, 2) int32        from, to
constraints.poses             (C, 3) float64      second keyframe relative to the first: metres, radians
constraints.information       (C, 3, 3) float64   in the tangent frame of the second keyframe
constraints.kinds             (C,) int8           0 odometry, 1 scan matching, 2 loop closure,
                                                  3 manual
loops.submaps                 (S, 3) int32        first, middle and last keyframe
loops.path                    (K,) float64        metres driven
loops.edges                   (E, 3) int32        submap, submap, 1 when a loop closure connects them
loops.variances               (V, 2) float64      accumulated variances of the steps to each of the first
                                                  V keyframes: square metres, square radians
loops.hypothesis_submaps      (H, 2) int32        fixed, moving; both of this session
loops.hypothesis_poses        (H, 3) float64      centre of the moving one relative to that of the fixed
loops.hypothesis_information  (H, 3, 3) float64   in the tangent frame of the moving one
loops.hypothesis_reaches      (H,) float64        metres of search window that it is judged by
loops.hypothesis_accepted     (H,) bool           whether it is a loop closure
loops.log_names               (L,) text           events of loop closure
loops.log_counts              (L,) int64          number of each
============================  ==================  ============================================================

A session that was corrected by hand also holds what was measured: ``measured.map_from_keyframe`` and
``measured.constraints``, as above, and ``measured.mended_by``, (1,) text, its manual constraints.
"""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import ConstraintList
from racecar.mapping.grid.rendering import Rays, returns_of
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.session.measured import Measured
from racecar.mapping.session.recordings import KeyframeTimes
from racecar.mapping.session.session_layout import checked_session
from racecar.maps.geometry.se2 import Pose, adjoint, compose, inverse
from racecar.maps.trajectory import Trajectory
from racecar.sensors.arrays import Arrays, named, pack, part_of, unpack
from racecar.sensors.matching.scan_store import ScanStore

SAME_PLACE = 1e-6
"""Metres, because a trajectory's file resolves a nanometre."""
_SAME_RETURN = 0.02
"""Metres between the ends of a ray in two maps of one recording, since each map learned its own deskewing."""


@dataclass(eq=False)
class Session:
    """Keyframes, constraints between them, and loop closures."""

    keyframes: ScanStore
    rays: list[Rays]
    """(K) rays of the keyframes."""
    keyframe_from_base: Pose
    """(K, 3) inverse mounts; a keyframe's frame is the laser's."""
    map_from_keyframe: Pose
    """(K, 3)"""
    constraints: ConstraintList
    loops: LoopHistory
    times: KeyframeTimes
    measured: Measured | None = None
    """What was measured, if the session was corrected by hand."""

    def frozen(self) -> "Session":
        """A snapshot for another thread to write; immutable parts are shared."""
        return Session(
            copy(self.keyframes),
            list(self.rays),
            self.keyframe_from_base,
            self.map_from_keyframe.copy(),
            self.constraints.copy(),
            self.loops.frozen(),
            self.times,
            self.measured,
        )

    def moved(self, new_from_map: Pose) -> "Session":
        """The session in another map frame; constraints and loops are relative and stay."""
        measured = None if self.measured is None else self.measured.moved(new_from_map)
        moved = compose(new_from_map, self.map_from_keyframe)
        return replace(self, map_from_keyframe=moved, measured=measured)

    @property
    def as_measured(self) -> "Session":
        """The session without manual constraints."""
        if (known := self.measured) is None:
            return self
        return replace(
            self, map_from_keyframe=known.map_from_keyframe, constraints=known.constraints, measured=None
        )

    def only(self, chosen: NDArray[np.bool_]) -> "Session":
        """The session of the selected keyframes (K,) and what is known among them."""
        return Session(
            self.keyframes.only(chosen),
            [self.rays[k] for k in np.flatnonzero(chosen)],
            self.keyframe_from_base[chosen],
            self.map_from_keyframe[chosen],
            self.constraints.among(chosen),
            self.loops.only(chosen),
            self.times.only(chosen),
            None if self.measured is None else self.measured.only(chosen),
        )

    @property
    def map_from_base(self) -> Pose:
        """(K, 3) poses of the car at the keyframes."""
        return compose(self.map_from_keyframe, self.keyframe_from_base)

    def is_of(self, trajectory: Trajectory) -> bool:
        """Whether a trajectory of base poses is that of the last recording, in this frame."""
        own = self.times.are_of_last
        scans = np.searchsorted(trajectory.stamps, self.times.stamps[own])
        if not own.any() or scans[-1] >= len(trajectory):
            return False
        are_same = trajectory.stamps[scans] == self.times.stamps[own]
        apart = trajectory.map_from_base[scans, :2] - self.map_from_base[own, :2]
        return bool(are_same.all() and np.abs(apart).max() < SAME_PLACE)

    @property
    def path(self) -> NDArray[np.float64]:
        """(K,) metres driven up to each keyframe; nothing is driven from one recording to another."""
        return np.concatenate([[0.0], np.cumsum(self.times.driven(self.map_from_keyframe))])

    @property
    def points(self) -> NDArray[np.float32]:
        """(N, 2) metres in the map: the returns of all keyframes."""
        return np.concatenate(list(returns_of(self.rays, self.map_from_keyframe))).astype(np.float32)

    def constraints_between_bases(self) -> ConstraintList:
        """The constraints, converted from lasers to the bases of the keyframes."""
        arrays = self.constraints.to_arrays()
        a_from_base, b_from_base = np.moveaxis(self.keyframe_from_base[arrays["keyframes"]], 1, 0)
        moved = compose(compose(inverse(a_from_base), arrays["poses"]), b_from_base)
        to_b = adjoint(b_from_base)
        information = np.swapaxes(to_b, 1, 2) @ arrays["information"] @ to_b
        return ConstraintList.from_arrays({**arrays, "poses": moved, "information": information})

    def to_arrays(self) -> Arrays:
        """The arrays documented above."""
        ends, lengths = pack([rays.ends for rays in self.rays], np.zeros((0, 2), dtype=np.float32))
        returns = np.array([rays.returns for rays in self.rays], dtype=np.int64)
        return {
            "keyframe_from_base": self.keyframe_from_base,
            "map_from_keyframe": self.map_from_keyframe,
            **named("times", self.times.to_arrays()),
            **named("scans", self.keyframes.to_arrays()),
            **named("rays", {"ends": ends, "lengths": lengths, "returns": returns}),
            **named("constraints", self.constraints.to_arrays()),
            **named("loops", self.loops.to_arrays()),
            **({} if self.measured is None else named("measured", self.measured.to_arrays())),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "Session":
        """Rebuild from `to_arrays`. Raises ValueError naming an array that is missing or invalid."""
        arrays = checked_session(arrays)
        ends = unpack(arrays["rays.ends"].astype(np.float32), arrays["rays.lengths"])
        returns = arrays["rays.returns"].tolist()
        return cls(
            ScanStore.from_arrays(part_of("scans", arrays)),
            [Rays.to(*rays) for rays in zip(ends, returns, strict=True)],
            arrays["keyframe_from_base"].astype(np.float64),
            arrays["map_from_keyframe"].astype(np.float64),
            ConstraintList.from_arrays(part_of("constraints", arrays)),
            LoopHistory.from_arrays(part_of("loops", arrays)),
            KeyframeTimes.from_arrays(part_of("times", arrays)),
            Measured.from_arrays(measured) if (measured := part_of("measured", arrays)) else None,
        )


def has_recording_of(one: Session, other: Session) -> bool:
    """Whether two sessions hold the same recording: scans of one time that saw the same. Times alone do not
    say so, because simulated drives begin at the same one."""
    of_one, of_other = np.nonzero(one.times.stamps[:, None] == other.times.stamps[None])
    return any(
        len(one.rays[a].ends) > 0
        and one.rays[a].ends.shape == other.rays[b].ends.shape
        and np.allclose(one.rays[a].ends, other.rays[b].ends, atol=_SAME_RETURN)
        for a, b in zip(of_one.tolist(), of_other.tolist(), strict=True)
    )
