"""What drives end in: round a block in a hall, in frames of their own, and of no rays and loops."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.session.recordings import KeyframeTimes, Recording
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore
from tests.sensors.worlds import box, store_of

BARE_RING = np.concatenate([box(-6, -4, 6, 4), box(-4, -2, 4, 2)])
"""12 x 8 m about a block; half round it looks the same again."""

RING = np.concatenate([BARE_RING, box(-1, 2, 0, 2.5), box(2, -4, 2.4, -3.4), box(5.5, 1, 6, 3)])
"""With things along the walls that make each place unique."""

CORNERS = np.array([(-5.0, -3.0), (5.0, -3.0), (5.0, 3.0), (-5.0, 3.0)])


def path(start: float, metres: float, corners: NDArray[np.float64] = CORNERS) -> Pose:
    """(K, 3) poses of the laser 0.3 m apart, round and round the block or another polygon (C, 2)."""
    ends = np.concatenate([corners, corners[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ends, axis=0).T))])
    at = np.arange(start, start + metres, 0.3)

    def place(at: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at % along[-1], along, axis) for axis in ends.T], axis=1)

    ahead = place(at + 0.5) - place(at)
    return np.column_stack([place(at), np.arctan2(ahead[:, 1], ahead[:, 0])])


def session(walls: np.ndarray, true: Pose, frame_from_world: Pose, base_from_laser: Pose) -> Session:
    """What a drive along ``true`` (K, 3) ends in, in a frame of its own."""
    store = store_of(walls, true)
    loops = LoopHistory()
    known = compose(frame_from_world, true)
    for step in [IDENTITY, *between(known[:-1], known[1:])]:
        loops.graph.add_keyframe(float(np.hypot(step[0], step[1])))
        loops.graph.add_variances(np.array([[0.01**2, 0.001**2]]))
    constraints = chain(known, np.diag([1e4, 1e4, 1e5])) + chain(known, np.diag([1e2, 1e2, 1e3]), "odometry")
    rays = [Rays.to(store.points_of(k), len(store.points_of(k))) for k in range(len(true))]
    laser_from_base = np.tile(inverse(base_from_laser), (len(true), 1))
    return Session(
        store, rays, laser_from_base, known, ConstraintList(constraints), loops, times(np.arange(len(true)))
    )


def plain_map(
    store: ScanStore,
    poses: Pose,
    constraints: list[Constraint],
    seconds: NDArray[np.float64],
    laser_from_base: Pose | None = None,
) -> FinishedMap:
    """To be judged: keyframes that were mapped to ``poses`` (K, 3), at so many seconds (K,)."""
    at_base = np.zeros_like(poses) if laser_from_base is None else laser_from_base
    nothing = [Rays.none() for _ in poses]
    tied = ConstraintList(constraints)
    return FinishedMap(Session(store, nothing, at_base, poses, tied, LoopHistory(), times(seconds)))


def times(seconds: NDArray[np.float64]) -> KeyframeTimes:
    """Keyframes of one recording, which began at 0."""
    stamps = (np.asarray(seconds) * 1e9).astype(np.int64)
    return KeyframeTimes.of(Recording("", 0, int(stamps[-1])), stamps)


def as_two_recordings(map_: FinishedMap, first: int) -> FinishedMap:
    """The same, with the keyframes from ``first`` on in a recording of their own."""
    known = map_.session.times
    is_later = np.arange(len(known.stamps)) >= first
    parts = [KeyframeTimes.of(known.recordings[0], known.stamps[which]) for which in (~is_later, is_later)]
    joined = parts[0].followed_by(parts[1], is_newer=False)
    return replace(map_, session=replace(map_.session, times=joined))


def one_drive(scans: int) -> NDArray[np.int32]:
    """(S,) drives of scans that belong to one."""
    return np.zeros(scans, dtype=np.int32)


def chain(poses: Pose, information: NDArray[np.float64], kind: Kind = "scan_matching") -> list[Constraint]:
    """Each pose tied to the one before it, where both are."""
    steps = between(poses[:-1], poses[1:])
    return [Constraint(k, k + 1, step, information, kind) for k, step in enumerate(steps)]
