"""Correlative scan matching by branch and bound: where in a window does one submap fit another?

Olson, "Real-time correlative scan matching", ICRA 2009; Hess et al., "Real-time loop closure in 2D LIDAR
SLAM", ICRA 2016. The search is exact on its grid: nothing in the window fits better than what it returns.
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
"""Metres between the places that are tried. Measured in a prototype: point-to-line alignment corrects the
rest."""
ANGLE_STEP = math.radians(0.75)
"""Radians between the headings that are tried, because at 8 m it moves a point by one cell."""
_BLUR = 0.12
"""Metres, standard deviation of how far a point may lie from those of the other scan: a little over a cell,
so that no wall falls between two places."""
_APART = int(1.0 / CELL), int(math.radians(10.0) / ANGLE_STEP)
"""Cells and steps, 1 m and 10 degrees, from the best place beyond which another is a place of its own, that
makes the best ambiguous. Measured in a prototype on aces, fr079 and intel."""
_LEVELS = 6
"""Of the pyramid, so that a block of the highest, 32 cells, spans the usual window: the result is the same
with any number of levels."""
_BORDER = 4
"""Cells left about the points, since beyond some standard deviations of the blur a cell's likelihood is
nought."""
_FULL = 255
"""The likelihood one, the largest number of 8 bits: the pyramids are kept so because it saves memory."""


@dataclass(frozen=True, eq=False)
class Window:
    """Where to look, about a guess."""

    reach: float
    """Metres to each side."""
    turn: float
    """Radians to each side."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The best place in a window."""

    pose: Pose
    """(3,) fixed_from_moving."""
    score: float
    """Mean likelihood of the moved points, 0 to 1."""
    runner_up: float = 0.0
    """Score of a second place, clearly apart from the first, as a share of the best; 0 when all others stay
    below the share that was asked for, or none was."""


class LikelihoodPyramid:
    """How likely a point of another scan falls on each cell, and the maxima over ever larger blocks."""

    def __init__(self, points: NDArray[np.float64], radius: float) -> None:
        """``points`` (N, 2) in the submap's frame; those beyond ``radius`` metres are left out.

        Where none is left, nothing fits anywhere.
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
        """(..., 2) row and column of points (..., 2) of the submap's frame."""
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
    """The pose (3,) near ``guess`` at which ``moving_points`` (N, 2) lie best on ``fixed``, but for those
    that are ``excluded``.

    None when the best score lies below ``min_score``; a runner-up is sought above ``runner_up_share`` of the
    best, or not at all.
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
    """The best place for ``moving_points`` (N, 2) clearly apart from a ``known`` one (3,), up to ``reach``
    metres to each side of the fixed submap's origin and in any heading; None below ``min_score``."""
    column, row = np.rint(known[:2] / CELL).astype(np.int64)
    about_known = Exclusion(int(np.ceil(np.pi / ANGLE_STEP)), int(row), int(column), *_APART)
    heading, anywhere = np.array([0.0, 0.0, known[2]]), Window(reach, np.pi)
    return search(fixed, moving_points, heading, anywhere, min_score, excluded=about_known)


def _turned(
    fixed: LikelihoodPyramid, points: NDArray[np.float64], guess: Pose, turn: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """(A,) the turns that are tried about a guess (3,), and (A, N, 2) the cells of points (N, 2) at each."""
    half_turns = int(np.ceil(turn / ANGLE_STEP))
    turns = np.arange(-half_turns, half_turns + 1, dtype=np.float64) * ANGLE_STEP
    cos, sin = np.cos(guess[2] + turns), np.sin(guess[2] + turns)
    x, y = points[:, 0], points[:, 1]
    rotated = np.stack([np.outer(cos, x) - np.outer(sin, y), np.outer(sin, x) + np.outer(cos, y)], axis=-1)
    return turns, fixed.cells_of(rotated + guess[:2])
