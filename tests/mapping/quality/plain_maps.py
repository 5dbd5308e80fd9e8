"""Maps to be judged, of drives that left no rays and closed no loops."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.session.session import Session, one_drive
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.scan_store import ScanStore


def plain_map(
    store: ScanStore,
    poses: Pose,
    constraints: list[Constraint],
    seconds: NDArray[np.float64],
    laser_from_base: Pose | None = None,
) -> FinishedMap:
    """Keyframes that were mapped to ``poses`` (K, 3), at so many seconds (K,)."""
    at_base = np.zeros_like(poses) if laser_from_base is None else laser_from_base
    nothing = [Rays.none() for _ in poses]
    tied = ConstraintList(constraints)
    return FinishedMap(
        Session(store, nothing, at_base, poses, tied, LoopHistory(), one_drive(len(poses))), seconds
    )


def chain(poses: Pose, information: NDArray[np.float64], kind: Kind = "scan_matching") -> list[Constraint]:
    """Each pose tied to the one before it, where both are."""
    steps = between(poses[:-1], poses[1:])
    return [Constraint(k, k + 1, step, information, kind) for k, step in enumerate(steps)]
