"""The path of a car that sees all of a map: to the nearest place not yet seen, again and again, then home."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.path_smoothing import lengths_along

SIGHT = 3.0
"""Metres; what is this near to the path, measured round corners as one drives, counts as seen."""

SMALL_POCKET = 1.0
"""Square metres; a smaller place that is left unseen is not gone to."""


@dataclass(frozen=True, eq=False)
class Route:
    """A round trip: it ends at the pose it starts from."""

    map_from_base: Pose
    """(N, 3), a few centimetres apart."""
    backwards: NDArray[np.bool_]
    """(N,) whether the car arrives at the pose in reverse gear."""

    @property
    def length(self) -> float:
        """Metres."""
        return float(lengths_along(self.map_from_base[:, :2])[-1])

    @property
    def is_lap(self) -> bool:
        """Whether it goes round without ever coming by the same place twice, as a race track does."""
        points = self.map_from_base[:, :2]
        along = lengths_along(points)
        pairs = cKDTree(points).query_pairs(0.5, output_type="ndarray")
        apart = np.abs(along[pairs[:, 0]] - along[pairs[:, 1]])
        again = pairs[np.minimum(apart, along[-1] - apart) > 5.0]
        return not self.backwards.any() and len(np.unique(again)) < 0.05 * len(points)


def plan_route(lattice: DrivingLattice, start: int) -> Route:
    """Drive from a node until all that is reachable has been seen and back to the same node."""
    neighbours = lattice.neighbour_graph()
    unseen = lattice.reachable.reshape(-1, 16).any(axis=1)
    unseen &= ~_in_sight(neighbours, [start // 16])
    here = start
    poses, backwards = [lattice.poses_of(np.array([start]))], [np.zeros(1, dtype=np.bool_)]
    while True:
        is_last = not unseen.any()
        is_goal = np.arange(len(lattice.reachable)) == start if is_last else np.repeat(unseen, 16)
        nodes = lattice.cheapest_path(here, is_goal)
        if not is_last:
            nodes = _until_in_sight(lattice, nodes)
        path, in_reverse = lattice.drive(nodes)
        poses.append(path)
        backwards.append(in_reverse)
        if is_last:
            return Route(np.concatenate(poses), np.concatenate(backwards))
        unseen &= ~_in_sight(neighbours, [node // 16 for node in nodes])
        unseen &= ~_in_small_pockets(neighbours, unseen, lattice.spacing)
        here = nodes[-1]


def choose_start(grid: OccupancyGrid, lattice: DrivingLattice, wanted: Pose | None) -> int:
    """The reachable node nearest to a wanted pose; without one, near the map's origin and looking far."""
    nodes = np.flatnonzero(lattice.reachable)
    poses = lattice.poses_of(nodes)
    if wanted is not None:
        turn = np.abs(wrap_angle(poses[:, 2] - wanted[2]))
        return int(nodes[np.argmin(np.linalg.norm(poses[:, :2] - wanted[:2], axis=1) + 0.5 * turn)])
    cell = nodes[np.argmin(np.linalg.norm(poses[:, :2], axis=1))] // 16
    nodes = nodes[nodes // 16 == cell]
    views = cast_ray_fan(grid, lattice.poses_of(nodes), [0.0], max_range=1e3)[:, 0]
    return int(nodes[np.argmax(views)])


def _until_in_sight(lattice: DrivingLattice, nodes: list[int]) -> list[int]:
    """The first part of a path, one step at least, that ends where its goal is well in sight.

    A car that goes no further need not turn in a corner that it only came to look at.
    """
    places = lattice.poses_of(np.array(nodes))[:, :2]
    is_far = np.linalg.norm(places - places[-1], axis=1) > SIGHT / 2
    return nodes[: max(2, int(np.flatnonzero(is_far).max(initial=0)) + 2)]


def _in_sight(neighbours: csr_array, cells: list[int]) -> NDArray[np.bool_]:
    """(cells,) whether within sight of some cells, measured as one drives."""
    distances = dijkstra(neighbours, directed=False, indices=np.unique(cells), limit=SIGHT, min_only=True)
    near: NDArray[np.bool_] = np.isfinite(distances)
    return near


def _in_small_pockets(neighbours: csr_array, unseen: NDArray[np.bool_], spacing: float) -> NDArray[np.bool_]:
    """(cells,) the unseen ones whose connected region is too small to go there for it."""
    cells = np.flatnonzero(unseen)
    _, region = connected_components(neighbours[cells][:, cells], directed=False)
    is_small = np.bincount(region) * spacing**2 < SMALL_POCKET
    small = np.zeros_like(unseen)
    small[cells[is_small[region]]] = True
    return small
