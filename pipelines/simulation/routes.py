"""Plan routes: repeatedly to the nearest unseen place and then home; or to a goal."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.pipelines.simulation.driving_lattice import DrivingLattice, Route

SIGHT = 3.0
"""Metres; places this near to the path, measured along drivable cells, count as seen."""

SMALL_POCKET = 1.0
"""Square metres; smaller unseen places are not visited."""


_AS_NEAR = 0.05
"""Metres by which a place may be farther from a goal than the nearest one and still count, so that the car
may arrive at the cheapest heading."""
_FARTHEST = 1.0
"""Metres between a goal and the nearest place where the car can stand, beyond which the goal is rejected."""


def round_trip(lattice: DrivingLattice, start: int) -> Route:
    """Drive from a node until everything reachable has been seen, and back to the same node."""
    neighbours = lattice.neighbour_graph()
    unseen = lattice.reachable.reshape(-1, 16).any(axis=1)
    unseen &= ~_in_sight(neighbours, [start // 16])
    nodes = [start]
    while unseen.any():
        leg = _until_in_sight(lattice, lattice.cheapest_path(nodes[-1], np.repeat(unseen, 16)))
        nodes += leg[1:]
        unseen &= ~_in_sight(neighbours, [node // 16 for node in leg])
        unseen &= ~_in_small_pockets(neighbours, unseen, lattice.spacing)
    home = lattice.cheapest_path(nodes[-1], np.arange(len(lattice.reachable)) == start)
    return lattice.drive(nodes + home[1:])


def choose_start(grid: OccupancyGrid, lattice: DrivingLattice, wanted: Pose | None) -> int:
    """The reachable node nearest to a wanted pose; by default one near the map's origin with a long view."""
    if wanted is not None:
        return int(np.argmin(lattice.distances_to(wanted)))
    distances = lattice.distances_to(np.zeros(2))
    nodes = np.flatnonzero(lattice.reachable)
    nodes = nodes[nodes // 16 == np.argmin(distances) // 16]
    views = cast_ray_fan(grid, lattice.poses_of(nodes), [0.0], max_range=1e3)[:, 0]
    return int(nodes[np.argmax(views)])


def route_to_goal(lattice: DrivingLattice, map_from_base: Pose, goal: NDArray[np.float64]) -> Route:
    """From near a pose (3,) to a goal: a place (2,), or a pose (3,) with its heading.

    Raises UserError when the car cannot stand near the goal.
    """
    distances = lattice.distances_to(goal)
    nearest = lattice.poses_of(np.array([np.argmin(distances)]))[0]
    if np.linalg.norm(nearest[:2] - goal[:2]) > _FARTHEST:
        raise UserError("The car cannot get there; click on free floor that is wide enough for it.")
    start = int(np.argmin(lattice.distances_to(map_from_base)))
    return lattice.drive(lattice.cheapest_path(start, distances <= distances.min() + _AS_NEAR))


def _until_in_sight(lattice: DrivingLattice, nodes: list[int]) -> list[int]:
    """The first part of a path, of at least one step, up to where its goal is well in sight.

    A car that goes no further need not turn in a corner that it only came to see.
    """
    places = lattice.poses_of(np.array(nodes))[:, :2]
    is_far = np.linalg.norm(places - places[-1], axis=1) > SIGHT / 2
    return nodes[: max(2, int(np.flatnonzero(is_far).max(initial=0)) + 2)]


def _in_sight(neighbours: csr_array, cells: list[int]) -> NDArray[np.bool_]:
    """(cells,) whether within sight of some cells, measured along drivable cells."""
    distances = dijkstra(neighbours, directed=False, indices=np.unique(cells), limit=SIGHT, min_only=True)
    near: NDArray[np.bool_] = np.isfinite(distances)
    return near


def _in_small_pockets(neighbours: csr_array, unseen: NDArray[np.bool_], spacing: float) -> NDArray[np.bool_]:
    """(cells,) the unseen ones whose connected region is too small for a visit."""
    cells = np.flatnonzero(unseen)
    _, region = connected_components(neighbours[cells][:, cells], directed=False)
    is_small = np.bincount(region) * spacing**2 < SMALL_POCKET
    small = np.zeros_like(unseen)
    small[cells[is_small[region]]] = True
    return small
