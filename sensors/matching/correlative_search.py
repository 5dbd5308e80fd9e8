"""Correlative scan matching by branch and bound: find one submap's pose in another within a window.

Olson, "Real-time correlative scan matching", ICRA 2009; Hess et al., "Real-time loop closure in 2D LIDAR
SLAM", ICRA 2016. The search is exact on its grid: no pose in the window scores higher than the result.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.matching.correlative_search_kernels import (
    NO_EXCLUSION,
    Exclusion,
    branch_and_bound,
    sliding_maximum,
)

CELL = 0.1
"""Search resolution in metres. Measured in a prototype: point-to-line matching corrects the rest."""
ANGLE_STEP = math.radians(0.75)
"""Search resolution in radians, because at 8 m it moves a point by one cell."""
_BLUR = 0.12
"""Metres, standard deviation of the blurred likelihood: slightly more than a cell, so that no wall falls
between two poses of the grid."""
_APART = int(1.0 / CELL), int(math.radians(10.0) / ANGLE_STEP)
"""Cells and steps, 1 m and 10 degrees, beyond which another pose is a separate peak that makes the best one
ambiguous. Measured in a prototype on aces, fr079 and intel."""
_LEVELS = 6
"""Pyramid levels, so that a block of the top level, 32 cells, spans the usual window. The number does not
change the result."""
_BORDER = 4
"""Margin of cells around the points, since beyond some standard deviations of the blur the likelihood is
zero."""
_FULL = 255
"""Likelihood one as the largest 8-bit number: the pyramids are stored so because it saves memory."""


@dataclass(frozen=True, eq=False)
class Window:
    """Search window around an initial guess."""

    reach: float
    """Metres to each side."""
    turn: float
    """Radians to each side."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Best pose in a window."""

    pose: Pose
    """(3,) fixed_from_moving."""
    score: float
    """Mean likelihood of the transformed points, 0 to 1."""
    runner_up: float = 0.0
    """Score of a second, separate peak relative to the best; 0 when all others stay below the requested
    share, or when none was requested."""


class LikelihoodPyramid:
    """Likelihood of a point of another scan per cell, and its maxima over ever larger blocks."""

    def __init__(self, points: NDArray[np.float64], radius: float) -> None:
        """Build from ``points`` (N, 2) in the submap's frame within ``radius`` metres.

        Without any such points, nothing matches.
        """
        near = points[np.abs(points).max(axis=1) < radius]
        if len(near) == 0:
            self._origin = np.zeros(2, dtype=np.int64)
            self.levels = np.zeros((_LEVELS, 1, 1), dtype=np.uint8)
            return
        margin = 1 << (_LEVELS - 1)
        low = np.floor(near.min(axis=0) / CELL).astype(np.int64) - _BORDER
        cells = np.floor(near / CELL).astype(np.int64) - low
        size = cells.max(axis=0) + _BORDER + 1
        empty = np.ones((size[1], size[0]), dtype=np.bool_)
        empty[cells[:, 1], cells[:, 0]] = False
        distance = distance_transform_edt(empty) * CELL
        likelihood = np.rint(_FULL * np.exp(-0.5 * (distance / _BLUR) ** 2)).astype(np.uint8)
        level = np.pad(likelihood, ((margin, 0), (margin, 0)))
        self.levels = np.empty((_LEVELS, *level.shape), dtype=np.uint8)
        self.levels[0] = level
        for h in range(1, _LEVELS):
            sliding_maximum(self.levels[h - 1], 1 << (h - 1), self.levels[h])
        self._origin = low - margin

    def cells_of(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """(..., 2) row and column of points (..., 2) in the submap's frame."""
        rows_and_columns = np.floor(points[..., ::-1] / CELL).astype(np.int64)
        cells: NDArray[np.int64] = rows_and_columns - self._origin[::-1]
        return cells.astype(np.int32)


def search(
    fixed: LikelihoodPyramid,
    moving_points: NDArray[np.float64],
    guess: Pose,
    window: Window,
    min_score: float,
    runner_up_share: float | None = None,
    excluded: Exclusion = NO_EXCLUSION,
) -> Fit | None:
    """The pose (3,) near ``guess`` at which ``moving_points`` (N, 2) score best on ``fixed``, except for
    ``excluded`` poses.

    None when the best score is below ``min_score``. The runner-up is searched for above ``runner_up_share``
    of the best score; by default it is not.
    """
    turns, cells = _turned(fixed, moving_points, guess, window.turn)
    reach = max(int(np.ceil(window.reach / CELL)), 1)
    full = _FULL * len(moving_points)
    score, a, dr, dc = branch_and_bound(fixed.levels, cells, reach, int(min_score * full), excluded, False)
    if score < 0:
        return None
    pose = compose(np.array([guess[0] + dc * CELL, guess[1] + dr * CELL, guess[2]]), [0.0, 0.0, turns[a]])
    if runner_up_share is None:
        return Fit(pose, score / full)
    least, about_best = int(runner_up_share * score), Exclusion(a, dr, dc, *_APART)
    second, *_ = branch_and_bound(fixed.levels, cells, reach, least, about_best, True)
    return Fit(pose, score / full, max(second, 0) / score)


def search_apart(
    fixed: LikelihoodPyramid, moving_points: NDArray[np.float64], known: Pose, reach: float, min_score: float
) -> Fit | None:
    """The best pose of ``moving_points`` (N, 2) clearly apart from a ``known`` one (3,), within ``reach``
    metres of the fixed submap's origin along each axis and at any heading; None below ``min_score``."""
    column, row = np.rint(known[:2] / CELL).astype(np.int64)
    about_known = Exclusion(int(np.ceil(np.pi / ANGLE_STEP)), int(row), int(column), *_APART)
    heading, anywhere = np.array([0.0, 0.0, known[2]]), Window(reach, np.pi)
    return search(fixed, moving_points, heading, anywhere, min_score, excluded=about_known)


def _turned(
    fixed: LikelihoodPyramid, points: NDArray[np.float64], guess: Pose, turn: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Rotations (A,) to try around a guess (3,), and cells (A, N, 2) of points (N, 2) at each rotation."""
    half_turns = int(np.ceil(turn / ANGLE_STEP))
    turns = np.arange(-half_turns, half_turns + 1, dtype=np.float64) * ANGLE_STEP
    cos, sin = np.cos(guess[2] + turns), np.sin(guess[2] + turns)
    x, y = points[:, 0], points[:, 1]
    rotated = np.stack([np.outer(cos, x) - np.outer(sin, y), np.outer(sin, x) + np.outer(cos, y)], axis=-1)
    return turns, fixed.cells_of(rotated + guess[:2])
