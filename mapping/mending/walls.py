"""Walls at points that people name, as the scans saw them, and constraints between the keyframes that did."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.mending.manual_constraints import Distance, RightAngle, Straight
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.maps.geometry.se2 import Pose, between, compose, inverse, transform_points, wrap_angle
from racecar.sensors.matching.scan_store import ScanStore

_SEEN_FROM = 10.0
"""Metres from a keyframe to walls that it is asked about. Chosen by judgement: there beams are dense."""
_NEAR = 0.3
"""Metres from a named point to the wall. Chosen by judgement: people click some cells beside it."""
_BENT = 1.0
"""Metres that a wall may lie off the straight line between two of its points, where the map bends it. Chosen
by judgement: a corridor is wider."""
_PIECE = 1.5
"""Metres about a point from which the direction of its wall is taken. Chosen by judgement: longer than door
frames, shorter than walls."""
_OFF_LINE = 0.05
"""Metres from its line within which a return is of a wall. Chosen by judgement: a cell of the map."""
_LEAST_POINTS = 6
"""Returns that show a direction, because fewer may lie in line by chance."""
_SPACING = 2.0
"""Metres between points of a straight wall. Chosen by judgement: as between submaps."""
_SIGMA = 0.01
"""Metres, standard deviation of a length that people measured. Chosen by judgement: a tape and a wall's
plaster."""
_SIGMA_ALONG = math.radians(1.0)
"""Radians, standard deviation of the direction of one piece of a straight wall. Chosen by judgement: doors
and pilasters."""
_SIGMA_CORNER = math.radians(0.3)
"""Radians, standard deviation of a right angle. Chosen by judgement: what builders keep to."""
_NEXT_TO_NOTHING = 1e-4
"""Information per square metre and radian about what a constraint leaves open, because the solver factorizes
it: 100 m, 100 rad."""
_LEAST_ALONG = math.cos(math.radians(30.0))
"""Cosine between a wall and the line that it is said to follow, so that crossing walls do not count."""


@dataclass(frozen=True, eq=False)
class WallPiece:
    """A piece of a wall in the frame of the keyframe that saw it."""

    keyframe: int
    point: NDArray[np.float64]
    """(2,) metres."""
    direction: NDArray[np.float64]
    """(2,) unit vector along the wall."""


def constraints_between_walls(
    constraint: Distance | Straight | RightAngle, pieces: list[WallPiece], poses: Pose
) -> list[Constraint]:
    """Constraints from the walls at ``pieces``, linearized about keyframe ``poses`` (K, 3)."""
    first, last = pieces[0], pieces[-1]
    if isinstance(constraint, Distance):
        return [_apart(first, last, constraint.metres, poses)]
    if isinstance(constraint, RightAngle):
        return [_square(first, last, poses)]
    return list(_in_line(pieces, poses))


def pieces_of(constraint: Distance | Straight | RightAngle, store: ScanStore, shown: Pose) -> list[WallPiece]:
    """The walls at the points of a constraint, in a map with keyframes at ``shown`` (K, 3).

    Raises RefusedConstraintError when there are none, or when one keyframe saw them all, so that nothing can
    give.
    """
    start, end = np.array(constraint.points)
    if isinstance(constraint, Straight):
        count = max(int(np.hypot(*(end - start)) / _SPACING), 2) + 1
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
        found = [_piece_at(point, store, shown, _BENT, along) for point in np.linspace(start, end, count)]
        pieces = [piece for piece in found if piece is not None]
        if found[0] is None or found[-1] is None or len(pieces) < 3:
            raise RefusedConstraintError(
                f"From {_at(start)} to {_at(end)} no scan saw a wall; name two points on one."
            )
    else:
        pieces = []
        for point in (start, end):
            piece = _piece_at(point, store, shown, _NEAR)
            if piece is None:
                raise RefusedConstraintError(f"Near {_at(point)} no scan saw a wall; name a point on one.")
            pieces.append(piece)
    if len({piece.keyframe for piece in pieces}) == 1:
        raise RefusedConstraintError(
            f"One scan saw the walls at {_at(start)} and {_at(end)} as they are; nothing there can give."
        )
    return pieces


def _piece_at(
    place: NDArray[np.float64],
    store: ScanStore,
    shown: Pose,
    reach: float,
    along: NDArray[np.float64] | None = None,
) -> WallPiece | None:
    """The nearest wall that a scan saw within ``reach`` metres of a place (2,); optionally only walls about
    ``along`` a unit vector (2,)."""
    away = np.hypot(*(shown[:, :2] - place).T)
    best, nearest = None, reach
    for keyframe in np.flatnonzero((away < _SEEN_FROM) & store.is_kept).tolist():
        seen = transform_points(shown[keyframe], store.points_of(keyframe).astype(np.float64))
        apart = np.hypot(*(seen - place).T)
        k = int(np.argmin(apart)) if len(apart) else 0
        if len(apart) == 0 or apart[k] >= nearest:
            continue
        direction = _direction(seen, seen[k])
        if direction is None or (along is not None and abs(direction @ along) < _LEAST_ALONG):
            continue
        in_keyframe = inverse(shown[keyframe])
        turn = np.array([0.0, 0.0, in_keyframe[2]])
        best = WallPiece(
            keyframe,
            transform_points(in_keyframe, seen[k : k + 1])[0],
            transform_points(turn, direction[None])[0],
        )
        nearest = float(apart[k])
    return best


def _direction(seen: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """(2,) direction of the wall at one of the returns (N, 2): of the line through it with most of those near
    it, fitted to these; None when they are too few."""
    near = seen[np.hypot(*(seen - at).T) < _PIECE] - at
    candidates = near[np.hypot(*near.T) > 0.1 * _PIECE]
    if len(candidates) == 0:
        return None
    across = np.column_stack([-candidates[:, 1], candidates[:, 0]]) / np.hypot(*candidates.T)[:, None]
    are_on_line = np.abs(near @ across.T) < _OFF_LINE
    on_line = near[are_on_line[:, int(np.argmax(are_on_line.sum(axis=0)))]]
    if len(on_line) < _LEAST_POINTS:
        return None
    _, _, axes = np.linalg.svd(on_line - on_line.mean(axis=0), full_matrices=False)
    return np.asarray(axes[0], dtype=np.float64)


def _apart(first: WallPiece, second: WallPiece, metres: float, poses: Pose) -> Constraint:
    """So far apart, along the line between both."""
    a, b = _in_map(first, poses), _in_map(second, poses)
    length = max(float(np.hypot(*(b - a))), 1e-6)
    unit = (b - a) / length
    target = poses[second.keyframe] + np.append((metres - length) * unit, 0.0)
    return _tie(first, second, target, [_row_of_shift(second, unit, target, _SIGMA)], poses)


def _square(first: WallPiece, second: WallPiece, poses: Pose) -> Constraint:
    """At right angles."""
    corner = _heading(second, poses) - _heading(first, poses)
    missing = (math.pi / 2.0 - corner + math.pi / 2.0) % math.pi - math.pi / 2.0  # walls have no sign
    target = compose(_about(_in_map(second, poses), missing), poses[second.keyframe])
    return _tie(first, second, target, [_row_of_turn(_SIGMA_CORNER)], poses)


def _in_line(pieces: list[WallPiece], poses: Pose) -> Iterator[Constraint]:
    """On the line from the first to the last, and along it."""
    first, last = pieces[0], pieces[-1]
    start = _in_map(first, poses)
    along = _in_map(last, poses) - start
    heading = math.atan2(along[1], along[0])
    across = np.array([-math.sin(heading), math.cos(heading)])
    for piece in pieces:
        off = float(across @ (_in_map(piece, poses) - start))
        turn = (heading - _heading(piece, poses) + math.pi / 2.0) % math.pi - math.pi / 2.0
        turned = compose(_about(_in_map(piece, poses), turn), poses[piece.keyframe])
        target = turned - np.append(off * across, 0.0)
        rows = [_row_of_shift(piece, across, target, _SIGMA), _row_of_turn(_SIGMA_ALONG)]
        other = last if piece is first else first
        if piece.keyframe != other.keyframe:
            yield _tie(other, piece, target, rows, poses)


def _tie(
    first: WallPiece, second: WallPiece, target: Pose, rows: list[NDArray[np.float64]], poses: Pose
) -> Constraint:
    """The second keyframe at ``target`` (3,), as far as ``rows`` (3,) in its tangent frame say."""
    information = np.sum([np.outer(row, row) for row in rows], axis=0) + _NEXT_TO_NOTHING * np.eye(3)
    relative = between(poses[first.keyframe], target)
    return Constraint(first.keyframe, second.keyframe, relative, information, "manual")


def _row_of_shift(
    piece: WallPiece, unit: NDArray[np.float64], target: Pose, sigma: float
) -> NDArray[np.float64]:
    """(3,) how a twist of the keyframe moves the piece along a unit vector (2,) of the map, in sigmas."""
    cos, sin = math.cos(target[2]), math.sin(target[2])
    x, y = cos * unit[0] + sin * unit[1], -sin * unit[0] + cos * unit[1]
    return np.array([x, y, y * piece.point[0] - x * piece.point[1]]) / sigma


def _row_of_turn(sigma: float) -> NDArray[np.float64]:
    return np.array([0.0, 0.0, 1.0 / sigma])


def _in_map(piece: WallPiece, poses: Pose) -> NDArray[np.float64]:
    return np.asarray(transform_points(poses[piece.keyframe], piece.point[None])[0], dtype=np.float64)


def _heading(piece: WallPiece, poses: Pose) -> float:
    return float(wrap_angle(math.atan2(piece.direction[1], piece.direction[0]) + poses[piece.keyframe, 2]))


def _about(center: NDArray[np.float64], turn: float) -> Pose:
    """(3,) a turn in place."""
    there = np.append(center, 0.0)
    return compose(compose(there, np.array([0.0, 0.0, turn])), inverse(there))


def _at(place: NDArray[np.float64]) -> str:
    return f"x {place[0]:.1f} m, y {place[1]:.1f} m"
