"""Drives round a block in a hall, as sessions in frames of their own."""

import numpy as np

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.session.session import Session, one_drive
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from tests.sensors.worlds import box, store_of

BARE_RING = np.concatenate([box(-6, -4, 6, 4), box(-4, -2, 4, 2)])
"""12 x 8 m about a block; half round it looks the same again."""

RING = np.concatenate([BARE_RING, box(-1, 2, 0, 2.5), box(2, -4, 2.4, -3.4), box(5.5, 1, 6, 3)])
"""With things along the walls that make each place unique."""

CORNERS = np.array([(-5.0, -3.0), (5.0, -3.0), (5.0, 3.0), (-5.0, 3.0)])


def path(start: float, metres: float) -> Pose:
    """(K, 3) poses of the laser 0.3 m apart, round the block."""
    ends = np.concatenate([CORNERS, CORNERS[:1]])
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
    steps = between(known[:-1], known[1:])
    for step in [IDENTITY, *steps]:
        loops.graph.add_keyframe(float(np.hypot(step[0], step[1])))
        loops.graph.add_variances(np.array([[0.01**2, 0.001**2]]))
    constraints = [
        Constraint(k, k + 1, step, np.diag([1e4, 1e4, 1e5]), "scan_matching") for k, step in enumerate(steps)
    ]
    constraints += [
        Constraint(k, k + 1, step, np.diag([1e2, 1e2, 1e3]), "odometry") for k, step in enumerate(steps)
    ]
    rays = [Rays.to(store.points_of(k), len(store.points_of(k))) for k in range(len(true))]
    laser_from_base = np.tile(inverse(base_from_laser), (len(true), 1))
    return Session(
        store, rays, laser_from_base, known, ConstraintList(constraints), loops, one_drive(len(true))
    )
