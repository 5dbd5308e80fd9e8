"""Points of walls that were clicked in a map under correction, where the map that it began with has them."""

from typing import cast

import numpy as np

from racecar.mapping.mending.manual_constraints import Distance, RightAngle, Straight, with_points
from racecar.mapping.mending.walls import pieces_of
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.sensors.matching.scan_store import ScanStore

WallConstraint = Distance | RightAngle | Straight


def as_at_first(constraint: WallConstraint, store: ScanStore, shown: Pose, first: Pose) -> WallConstraint:
    """A constraint between points of the map with keyframes at ``shown`` (K, 3), in the one with keyframes at
    ``first`` (K, 3). Raises UserError where no scan saw a wall."""
    pieces = pieces_of(constraint, store, shown)
    points = [transform_points(first[each.keyframe], each.point[None])[0] for each in (pieces[0], pieces[-1])]
    return cast(WallConstraint, with_points(constraint, np.array(points)))
