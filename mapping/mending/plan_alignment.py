"""Where a floor plan lies under a map, and at which scale: a similarity from pairs of points, refined on the
walls of both by iterated closest points (point to line, with robust weights)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.mending.floor_plan import FloorPlan
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.geometry.alignment import rigid_alignment
from racecar.maps.geometry.se2 import Pose, compose, transform_points

_CELL = 0.05
"""Metres within which returns are averaged, because walls count by their length, not by how often they were
seen. Chosen by judgement: a cell of the map."""
_SIDES = 8
"""Directions of normals that are averaged apart, so that both faces of a thin wall remain."""
_MOST_POINTS, _MOST_OF_PLAN = 20_000, 500_000
"""Points of the map that are aligned, and of the plan. Chosen by judgement: centimetres apart in a building,
and aligned in seconds."""
_ACROSS = 0.5
"""Metres by which walls at 60° to each other count as apart. Chosen by judgement: a wall's thickness, so that
no face is taken for the other."""
_REACHES = (1.0, 0.5, 0.25, 0.1)
"""Metres at which a wall loses most of its weight, one after the other. Chosen by judgement: from what
people click wrongly to what plans are drawn wrongly."""
_STEPS, _SETTLED = 20, 1e-5
"""Steps with each reach, at most, and the metres and radians of one that is the last. Chosen by judgement: a
millimetre at the far end of a building."""
_CLICKED = 0.3
"""Metres, standard deviation of a point that people name, which says where a plan lies along bare walls.
Chosen by judgement: some pixels."""
_MISMATCHED = 1.0
"""Metres that a point may lie off after the alignment by points. Chosen by judgement: three standard
deviations, as above."""
_ON_EACH_OTHER = 0.1
"""Metres between walls that agree. Chosen by judgement: two cells of the map, and as exact as plans are."""
_WALL_WEIGHT = _CELL / _ON_EACH_OTHER**2
"""Per square metre, of a point, because a metre of wall tells as much as one observation."""
_LEAST_SHARE = 0.5
"""Share of the map's walls that lie on the plan's at least. Chosen by judgement: furniture is less than half
of what a laser sees in most rooms."""
_DISPLACED = 0.4
"""Metres by which the plan is displaced to see which share agrees by chance. Chosen by judgement: four times
what agrees."""
_BEYOND_CHANCE = 0.3
"""Share beyond that of chance, at least. Chosen by judgement: see the share above."""


@dataclass(frozen=True, eq=False)
class PlanAlignment:
    """Where a plan lies, and how well it fits."""

    plan_from_map: Pose
    """(3,) from the map to the plan's frame in metres."""
    metres_per_unit: float
    """Metres of the map per unit of the drawing."""
    share: float
    """Share of the map's straight walls that lie on the plan's."""
    residual: float
    """Metres, root mean square distance between those."""


@dataclass(frozen=True, eq=False)
class _Similarity:
    """Takes points of the map to the plan."""

    scale: float
    turn: float
    shift: NDArray[np.float64]

    def turned(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        return transform_points([0.0, 0.0, self.turn], vectors)

    def placed(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.scale * self.turned(points) + self.shift

    def stepped(self, step: NDArray[np.float64]) -> "_Similarity":
        """After a step (4,): logarithm of the scale, turn, shift."""
        return _Similarity(self.scale * math.exp(step[0]), self.turn + float(step[1]), self.shift + step[2:])


class _PlanWalls:
    """Walls of a plan in metres, at a scale."""

    def __init__(self, plan: FloorPlan, metres_per_unit: float) -> None:
        length = metres_per_unit * float(np.hypot(*np.diff(plan.lines, axis=1)[:, 0].T).sum())
        spacing = max(_CELL / 2.0, length / _MOST_OF_PLAN)
        points, self._normals = plan.sampled(spacing / metres_per_unit)
        self._points = metres_per_unit * points
        self._tree = cKDTree(np.column_stack([self._points, _ACROSS * self._normals]))

    def nearest(
        self, points: NDArray[np.float64], normals: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The nearest points (N, 2), their normals (N, 2), and how far apart (N,) they are, where walls in
        other directions count as farther."""
        apart, found = self._tree.query(np.column_stack([points, _ACROSS * normals]))
        return self._points[found], self._normals[found], np.asarray(apart)


def aligned_by_points(
    plan: FloorPlan, in_plan: NDArray[np.float64], in_map: NDArray[np.float64]
) -> PlanAlignment:
    """The least-squares similarity (Umeyama, 1991) of points (N, 2) in the plan, y upwards, and places (N, 2)
    in the map; the walls are not compared.

    Raises RefusedConstraintError when it is not defined, or the points contradict each other.
    """
    a, b = in_map - in_map.mean(axis=0), in_plan - in_plan.mean(axis=0)
    if len(a) < 2 or not a.any() or not b.any():
        raise RefusedConstraintError(
            f"{plan.name} needs two points or more that differ, in the plan and in the map."
        )
    turned = transform_points(np.array([0.0, 0.0, rigid_alignment(in_map, in_plan)[2]]), a)
    scale = float(np.sum(a**2)) / max(float(np.sum(turned * b)), 1e-12)
    plan_from_map = rigid_alignment(in_map, scale * in_plan)
    off = np.hypot(*(transform_points(plan_from_map, in_map) - scale * in_plan).T)
    if off.max() > _MISMATCHED:
        raise RefusedConstraintError(
            f"The points contradict each other: with all of them as well as can be, point "
            f"{int(off.argmax()) + 1} of {plan.name} lies {off.max():.1f} m beside its place in the map."
        )
    return PlanAlignment(plan_from_map, scale, 0.0, 0.0)


def refined_on_walls(
    plan: FloorPlan, session: Session, in_plan: NDArray[np.float64], in_map: NDArray[np.float64]
) -> PlanAlignment:
    """The alignment by points as above, refined on the walls.

    Raises RefusedConstraintError when the points contradict each other, or when too few walls agree.
    """
    by_points = aligned_by_points(plan, in_plan, in_map)
    points, normals = walls_of(session)
    walls = _PlanWalls(plan, by_points.metres_per_unit)
    clicked = by_points.metres_per_unit * in_plan
    found = _Similarity(1.0, float(by_points.plan_from_map[2]), by_points.plan_from_map[:2])
    for reach in _REACHES:
        for _ in range(_STEPS):
            step = _step(found, walls, points, normals, reach, clicked, in_map)
            found = found.stepped(step)
            if np.abs(step).max() < _SETTLED:
                break
    placed, turned = found.placed(points), found.turned(normals)
    apart = walls.nearest(placed, turned)[2]
    agree = apart < _ON_EACH_OTHER
    share = float(np.mean(agree))
    if share < max(_LEAST_SHARE, _share_by_chance(walls, placed, turned) + _BEYOND_CHANCE):
        raise RefusedConstraintError(
            f"Only {share:.0%} of the map's walls lie on those of {plan.name}: check the points, and whether "
            "it shows this floor as it is built, not mirrored."
        )
    pose = np.append(found.shift / found.scale, found.turn)
    residual = float(np.sqrt(np.mean(apart[agree] ** 2)))
    return PlanAlignment(pose, by_points.metres_per_unit / found.scale, share, residual)


def _step(
    found: _Similarity,
    walls: _PlanWalls,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    reach: float,
    clicked: NDArray[np.float64],
    in_map: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(4,) a Gauss-Newton step: points onto the lines of the nearest walls, and the points that people
    named onto each other."""
    placed, named = found.placed(points), found.placed(in_map)
    feet, across, apart = walls.nearest(placed, found.turned(normals))
    rows = [_rows(placed - found.shift, across)]
    misses = [np.sum(across * (feet - placed), axis=1)]
    weights = [_WALL_WEIGHT / (1.0 + (apart / reach) ** 2) ** 2]  # Geman and McClure, 1985
    for axis in np.eye(2):
        rows.append(_rows(named - found.shift, np.tile(axis, (len(named), 1))))
        misses.append((clicked - named) @ axis)
        weights.append(np.full(len(named), _CLICKED**-2))
    jacobian = np.concatenate(rows)
    weighted = jacobian * np.concatenate(weights)[:, None]
    return np.linalg.solve(weighted.T @ jacobian, weighted.T @ np.concatenate(misses))


def walls_of(session: Session) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (N, 2) on the straight walls of a map and their normals (N, 2), evenly spread.

    Raises RefusedConstraintError when there are none.
    """
    scans = session.keyframes.to_arrays()
    is_straight = scans["normals"].any(axis=1)
    if not is_straight.any():
        raise RefusedConstraintError("The map shows no straight walls that could be laid on a plan.")
    counts = scans["counts"].astype(np.int64)
    poses = np.repeat(session.map_from_keyframe, counts, axis=0)[is_straight]
    headings = np.arctan2(*scans["normals"][is_straight].T[::-1])
    faces = compose(poses, np.column_stack([scans["points"][is_straight], headings]))
    normals = np.column_stack([np.cos(faces[:, 2]), np.sin(faces[:, 2])])
    sides = np.rint(faces[:, 2] * _SIDES / math.tau) % _SIDES
    cells = np.column_stack([np.floor(faces[:, :2] / _CELL), sides]).astype(np.int64)
    of = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1)
    sums = np.column_stack([np.bincount(of, each) for each in (*faces[:, :2].T, *normals.T)])
    means: NDArray[np.float64] = sums / np.bincount(of)[:, None]
    means = means[:: -(-len(means) // _MOST_POINTS)]
    return means[:, :2], means[:, 2:] / np.hypot(*means[:, 2:].T)[:, None]


def _share_by_chance(walls: _PlanWalls, placed: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """The share of points (N, 2) that lie on walls likewise after they were displaced."""
    headings = np.arange(_SIDES) * math.tau / _SIDES
    shifts = _DISPLACED * np.column_stack([np.cos(headings), np.sin(headings)])
    return float(np.mean([walls.nearest(placed + shift, normals)[2] < _ON_EACH_OTHER for shift in shifts]))


def _rows(arms: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4) how a step moves points along axes (N, 2), when ``arms`` (N, 2) lead there from its centre."""
    turning = np.column_stack([-arms[:, 1], arms[:, 0]])
    return np.column_stack([np.sum(arms * axes, axis=1), np.sum(turning * axes, axis=1), axes])
