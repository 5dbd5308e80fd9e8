"""Where a car can drive in a map: a graph of poses connected by short curves that its steering allows.

Poses lie on a square lattice with 16 headings, chosen so that a straight line along each heading hits lattice
points; the curves between them end exactly on it (a state lattice: M. Pivtoraiko, A. Kelly: Efficient
Constrained Path Planning via Search in State Lattices, 2005). Each curve can also be driven backwards, so the
car can leave any place that it can reach.
"""

import heapq
import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from racecar.maps.errors import UserError
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose, compose, transform_points, wrap_angle
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED_FROM, OccupancyGrid
from racecar.pipelines.simulation.car import BODY_CENTERS, BODY_RADIUS

DIRECTIONS = np.array([
    (1, 0), (2, 1), (1, 1), (1, 2), (0, 1), (-1, 2), (-1, 1), (-2, 1),
    (-1, 0), (-2, -1), (-1, -1), (-1, -2), (0, -1), (1, -2), (1, -1), (2, -1),
])  # fmt: skip
"""(16, 2) step to the next lattice point along each heading."""
HEADINGS = np.arctan2(DIRECTIONS[:, 1], DIRECTIONS[:, 0]).astype(np.float64)

PLANNED_CLEARANCE = BODY_RADIUS + 0.12
"""Metres from the centres of the body's discs to the nearest obstacle: the body, and a margin since the
driver follows a path to within some centimetres."""
COMFORTABLE_CLEARANCE = 0.8
"""Metres beyond which more clearance makes a path no better."""
MIN_TURNING_RADIUS = 0.9
"""Metres; the steering allows 0.78, which leaves the driver a margin for corrections."""
SPACING = 0.2
"""Metres between lattice points."""
MAX_CELLS = 60_000
"""Above this number of cells the lattice gets a wider spacing."""
REVERSE_PENALTY = 4.0
"""Cost factor of a metre in reverse, so that the car reverses only where it cannot turn."""
_CROWDING, _BENDING = 3.0, 1.05
"""Extra cost of a metre right beside a wall (a share), and cost factor of a curve. Chosen by judgement, so
that the car keeps to the middle of corridors and does not weave."""
_PER_RADIAN = 0.5
"""Metres per radian of heading. Chosen by judgement: the driver turns that much in as many metres."""
_SMALLEST_COMPONENT = 100
"""Nodes; a map whose largest connected part is smaller leaves no room to drive."""


@dataclass(frozen=True, eq=False)
class Curve:
    """From the lattice point (0, 0) at one heading to another point and heading."""

    offset: tuple[int, int]
    """Rows and columns."""
    end_heading: int
    poses: Pose
    """(K, 3) in metres along the curve, including both ends."""
    length: float

    @property
    def is_bent(self) -> bool:
        """Whether the car has to steer."""
        return bool(np.ptp(self.poses[:, 2]) > 1e-6)


@lru_cache(maxsize=64)
def curves_from(heading: int, spacing: float) -> tuple[Curve, ...]:
    """The shortest curve for each turn of up to two headings, and for a lane change to either side."""
    chosen: list[Curve] = []
    for turn in (-2, -1, 0, 1, 2):
        curves = _drivable_curves(heading, (heading + turn) % 16, spacing)
        straight = [curve for curve in curves if _side(curve, heading) == 0]
        aside = [curve for curve in curves if _side(curve, heading) != 0]
        if turn != 0:
            chosen.append(min(curves, key=lambda curve: curve.length))
            continue
        chosen.append(min(straight, key=lambda curve: curve.length))
        for side in (-1, 1):
            chosen.append(
                min(
                    (curve for curve in aside if _side(curve, heading) == side),
                    key=lambda curve: curve.length,
                )
            )
    return tuple(chosen)


def _side(curve: Curve, heading: int) -> int:
    (rows, columns), (x, y) = curve.offset, DIRECTIONS[heading]
    return int(np.sign(x * rows - y * columns))


def _drivable_curves(start: int, end: int, spacing: float) -> list[Curve]:
    reach = range(-8, 9)
    curves = []
    for rows in reach:
        for columns in reach:
            ahead = columns * DIRECTIONS[start, 0] + rows * DIRECTIONS[start, 1]
            if ahead <= 0:
                continue
            poses, curvature = _hermite(spacing * np.array([columns, rows]), HEADINGS[start], HEADINGS[end])
            if np.abs(curvature).max() > 1.0 / MIN_TURNING_RADIUS:
                continue
            length = float(np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum())
            curves.append(Curve((rows, columns), end, poses, length))
    return curves


def _hermite(end: NDArray[np.float64], start_yaw: float, end_yaw: float) -> tuple[Pose, NDArray[np.float64]]:
    """Poses (K, 3) and curvature (K,) of a cubic from the origin, with the speed of a circular arc."""
    t = np.linspace(0.0, 1.0, 17)[:, None]
    turn = float(wrap_angle(end_yaw - start_yaw))
    speed = np.linalg.norm(end) * (1.0 + turn**2 / 24.0)
    leaving = speed * np.array([np.cos(start_yaw), np.sin(start_yaw)])
    arriving = speed * np.array([np.cos(end_yaw), np.sin(end_yaw)])
    place = (3 * t**2 - 2 * t**3) * end + (t**3 - 2 * t**2 + t) * leaving + (t**3 - t**2) * arriving
    first = (6 * t - 6 * t**2) * end + (3 * t**2 - 4 * t + 1) * leaving + (3 * t**2 - 2 * t) * arriving
    second = (6 - 12 * t) * end + (6 * t - 4) * leaving + (6 * t - 2) * arriving
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    yaw = np.arctan2(first[:, 1], first[:, 0])
    return np.column_stack([place, yaw]), cross / np.linalg.norm(first, axis=1) ** 3


@dataclass(frozen=True, eq=False)
class Route:
    """A path that a car can drive."""

    map_from_base: Pose
    """(N, 3), a few centimetres apart."""
    backwards: NDArray[np.bool_]
    """(N,) whether the car reaches the pose in reverse gear."""

    @property
    def length(self) -> float:
        """Metres."""
        return float(lengths_along(self.map_from_base[:, :2])[-1])

    @property
    def is_lap(self) -> bool:
        """Whether it is a closed circuit that never visits a place twice, like a race track."""
        points = self.map_from_base[:, :2]
        along = lengths_along(points)
        pairs = cKDTree(points).query_pairs(0.5, output_type="ndarray")
        apart = np.abs(along[pairs[:, 0]] - along[pairs[:, 1]])
        again = pairs[np.minimum(apart, along[-1] - apart) > 5.0]
        return not self.backwards.any() and len(np.unique(again)) < 0.05 * len(points)


class DrivingLattice:
    """All poses of the largest connected part of a map at which the car fits, and the paths between them.

    Nodes are numbered ``cell * 16 + heading``.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        """Raises UserError when the car fits nowhere."""
        self._grid = grid
        self.clearance = clearance_field(grid)
        area = np.count_nonzero(self.clearance >= PLANNED_CLEARANCE) * grid.resolution**2
        self.spacing = SPACING * max(1.0, float(np.ceil(np.sqrt(area / SPACING**2 / MAX_CELLS))))
        self._number_of_place, self._place_of_number = self._number_places()
        self.graph = self._join_nodes()
        """(nodes, nodes) cost of the curve between two nodes, in weighted metres."""
        _, component = connected_components(self.graph, directed=False)
        sizes = np.bincount(component, minlength=1)
        if sizes.max() < _SMALLEST_COMPONENT:
            raise UserError(
                "The car finds no room to drive in this map: "
                f"it needs connected free places at least {2 * PLANNED_CLEARANCE:.1f} m wide."
            )
        self.reachable: NDArray[np.bool_] = component == sizes.argmax()
        """(nodes,) those that the car can reach and return from."""

    def poses_of(self, nodes: NDArray[np.int64]) -> Pose:
        """(N, 3) ``map_from_base``."""
        places = self._place_of_number[nodes // 16]
        grid_from_base = np.column_stack([self._centers(places), HEADINGS[nodes % 16]])
        return compose(self._grid.map_from_grid, grid_from_base)

    def cheapest_path(self, start: int, is_goal: NDArray[np.bool_]) -> list[int]:
        """The nodes from a start to the cheapest goal; ValueError if none can be reached."""
        node, predecessors = cheapest_goal(
            self.graph.indptr, self.graph.indices, self.graph.data, start, is_goal & self.reachable
        )
        if node < 0:
            raise ValueError("no goal can be reached from the start")
        nodes = [node]
        while nodes[-1] != start:
            nodes.append(int(predecessors[nodes[-1]]))
        return nodes[::-1]

    def drive(self, nodes: list[int]) -> Route:
        """The route along the curves between nodes, from the first to the last."""
        poses, backwards = [self.poses_of(np.array(nodes[:1]))], [np.zeros(1, dtype=np.bool_)]
        for a, b in itertools.pairwise(nodes):
            curve, is_backwards = self._curve_between(a, b)
            poses.append(curve[1:])
            backwards.append(np.full(len(curve) - 1, is_backwards))
        return Route(np.concatenate(poses), np.concatenate(backwards))

    def distances_to(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """(nodes,) metres to a place (2,), or to a pose (3,) including turns; infinite for nodes that the car
        cannot reach."""
        distances = np.full(len(self.reachable), np.inf)
        nodes = np.flatnonzero(self.reachable)
        poses = self.poses_of(nodes)
        distances[nodes] = np.linalg.norm(poses[:, :2] - pose[:2], axis=1)
        if len(pose) == 3:
            distances[nodes] += _PER_RADIAN * np.abs(wrap_angle(poses[:, 2] - pose[2]))
        return distances

    def neighbour_graph(self) -> csr_array:
        """(cells, cells) metres between neighbouring cells, including diagonal ones."""
        places = self._place_of_number
        rows, columns, lengths = [], [], []
        for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
            there = self._numbers_at(places + step)
            exists = there >= 0
            rows.append(np.flatnonzero(exists))
            columns.append(there[exists])
            lengths.append(np.full(exists.sum(), self.spacing * np.hypot(*step)))
        entries = np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))
        return coo_array(entries, shape=(len(places), len(places))).tocsr()

    def _number_places(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The number of each place (rows, columns), -1 if the car does not fit; the place of each number."""
        size = np.array(self._grid.cells.shape) * self._grid.resolution
        shape = np.maximum(size // self.spacing, 1).astype(int)
        places = np.argwhere(np.ones(shape, dtype=np.bool_))
        places = places[self._clearance_at(self._centers(places)) >= PLANNED_CLEARANCE]
        numbers = np.full(shape, -1, dtype=np.int64)
        numbers[tuple(places.T)] = np.arange(len(places))
        return numbers, places

    def _centers(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N, 2) points in the grid's frame."""
        centers: NDArray[np.float64] = (places[:, ::-1].astype(np.float64) + 0.5) * self.spacing
        return centers

    def _numbers_at(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        shape = self._number_of_place.shape
        inside = np.all((places >= 0) & (places < shape), axis=1)
        numbers = np.full(len(places), -1, dtype=np.int64)
        numbers[inside] = self._number_of_place[tuple(places[inside].T)]
        return numbers

    def _clearance_at(self, points_in_grid: NDArray[np.float64]) -> NDArray[np.float32]:
        cells = (points_in_grid[:, ::-1] / self._grid.resolution).astype(np.int64)
        cells = np.clip(cells, 0, np.array(self.clearance.shape) - 1)
        return self.clearance[cells[:, 0], cells[:, 1]]

    def _join_nodes(self) -> csr_array:
        sources, targets, costs = [], [], []
        for heading in range(16):
            for curve in curves_from(heading, self.spacing):
                from_cell, to_cell, clearance = self._fitting(curve)
                sources.append(from_cell * 16 + heading)
                targets.append(to_cell * 16 + curve.end_heading)
                discomfort = np.clip(1.0 - clearance / COMFORTABLE_CLEARANCE, 0.0, None)
                costs.append(
                    curve.length * (1.0 + _CROWDING * discomfort) * (_BENDING if curve.is_bent else 1.0)
                )
        nodes = 16 * len(self._place_of_number)
        entries = np.concatenate(costs), (np.concatenate(sources), np.concatenate(targets))
        forwards = coo_array(entries, shape=(nodes, nodes)).tocsr()
        both: csr_array = forwards + forwards.T * REVERSE_PENALTY
        return both.tocsr()

    def _fitting(self, curve: Curve) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
        """Start cells, end cells and minimum clearances, (N,) each, of the curve where it can be driven."""
        to_cell = self._numbers_at(self._place_of_number + np.array(curve.offset))
        from_cell = np.flatnonzero(to_cell >= 0)
        starts = self._centers(self._place_of_number[from_cell])
        clearance = np.full(len(from_cell), np.inf, dtype=np.float32)
        for pose in curve.poses[::2]:
            for body in transform_points(pose, BODY_CENTERS):
                clearance = np.minimum(clearance, self._clearance_at(starts + body))
        fits = clearance >= PLANNED_CLEARANCE
        return from_cell[fits], to_cell[from_cell[fits]], clearance[fits]

    def _curve_between(self, a: int, b: int) -> tuple[Pose, bool]:
        """Poses (K, 3) from one node to a neighbour, and whether they are driven in reverse."""
        for start, end, is_backwards in ((a, b, False), (b, a, True)):
            places = self._place_of_number[[start // 16, end // 16]]
            for curve in curves_from(start % 16, self.spacing):
                if curve.end_heading == end % 16 and np.array_equal(places[1] - places[0], curve.offset):
                    origin = np.array([*self._centers(places[:1])[0], 0.0])
                    poses = compose(self._grid.map_from_grid, compose(origin, curve.poses))
                    return (poses[::-1] if is_backwards else poses), is_backwards
        raise ValueError("the nodes are no neighbours")


def clearance_field(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(rows, columns) metres from each cell's centre to that of the nearest cell not known to be free."""
    free = np.pad((grid.cells >= FREE) & (grid.cells < OCCUPIED_FROM), 1)
    distances: NDArray[np.float64] = distance_transform_edt(free, sampling=grid.resolution)
    return distances[1:-1, 1:-1].astype(np.float32)


@njit(cache=True, nogil=True)
def cheapest_goal(
    first_edge: NDArray[np.int32],
    edge_target: NDArray[np.int32],
    edge_cost: NDArray[np.float64],
    start: int,
    is_goal: NDArray[np.bool_],
) -> tuple[int, NDArray[np.int32]]:
    """The cheapest goal to reach, -1 if there is none, and each node's predecessor on the path to it.

    Dijkstra's search that ends at a goal, which scipy's does not support.

    The graph is in compressed rows: the edges of node n are first_edge[n] to first_edge[n + 1] - 1.
    """
    costs = np.full(len(is_goal), np.inf)
    predecessors = np.full(len(is_goal), -1, dtype=np.int32)
    costs[start] = 0.0
    queue = [(0.0, start)]
    while len(queue) > 0:
        cost, node = heapq.heappop(queue)
        if cost > costs[node]:
            continue
        if is_goal[node]:
            return node, predecessors
        for edge in range(first_edge[node], first_edge[node + 1]):
            target = edge_target[edge]
            reached = cost + edge_cost[edge]
            if reached < costs[target]:
                costs[target] = reached
                predecessors[target] = node
                heapq.heappush(queue, (reached, int(target)))
    return -1, predecessors
