"""The way to a clicked goal."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.pipelines.simulation.coverage_route import Route
from racecar.pipelines.simulation.driving_lattice import DrivingLattice

_AS_NEAR = 0.05
"""Metres by which a place may be farther from the goal than the nearest one, and count as well: so the car
may arrive at whichever heading is cheapest."""
_PER_RADIAN = 0.5
"""Metres that a radian of heading counts, by judgement: the driver turns that much in as many metres."""
_FARTHEST = 1.0
"""Metres from the goal to the nearest place where the car can stand, beyond which the goal is refused."""


class GoalPlanner:
    """Routes over a driving lattice, from anywhere to anywhere."""

    def __init__(self, lattice: DrivingLattice) -> None:
        self._lattice = lattice
        self._nodes = np.flatnonzero(lattice.reachable)
        self._poses = lattice.poses_of(self._nodes)

    @property
    def poses(self) -> Pose:
        """(N, 3) all poses that the car can get to and back from."""
        return self._poses

    def route(self, map_from_base: Pose, goal: NDArray[np.float64]) -> Route:
        """From a pose (3,) to a goal: a place (2,), or a pose (3,) whose heading counts too.

        Raises UserError when the car cannot stand near the goal.
        """
        start = int(self._nodes[np.argmin(self._distances(map_from_base))])
        distances = self._distances(goal)
        if np.linalg.norm(self._poses[np.argmin(distances), :2] - goal[:2]) > _FARTHEST:
            raise UserError("The car cannot get there; click on free floor that is wide enough for it.")
        is_goal = np.zeros(len(self._lattice.reachable), dtype=np.bool_)
        is_goal[self._nodes[distances <= distances.min() + _AS_NEAR]] = True
        nodes = self._lattice.cheapest_path(start, is_goal)
        path, backwards = self._lattice.drive(nodes)
        first = self._lattice.poses_of(np.array(nodes[:1]))
        return Route(np.concatenate([first, path]), np.concatenate([backwards[:1], backwards]))

    def _distances(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) metres to a place (2,), or to a pose (3,) with the turns counted."""
        distances: NDArray[np.float64] = np.linalg.norm(self._poses[:, :2] - pose[:2], axis=1)
        if len(pose) == 3:
            distances += _PER_RADIAN * np.abs(wrap_angle(self._poses[:, 2] - pose[2]))
        return distances
