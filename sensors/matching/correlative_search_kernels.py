"""Branch and bound over translations and rotations: the inner loops."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Exclusion(NamedTuple):
    """Leaves excluded from the search: those close to a given one."""

    angle: int
    """Angle index of that leaf; -1 excludes nothing."""
    row: int
    column: int
    cells: int
    """Excluded distance around it, in cells."""
    angles: int


NO_EXCLUSION = Exclusion(-1, 0, 0, 0, 0)
"""Nothing is excluded, by definition of the first field."""


@njit(cache=True, nogil=True)
def sliding_maximum(level: NDArray[np.uint8], reach: int, out: NDArray[np.uint8]) -> None:
    """``out[r, c]`` = maximum of ``level`` at r or r + reach, c or c + reach: one step up the pyramid."""
    rows, columns = level.shape
    for r in range(rows):
        below = min(r + reach, rows - 1)
        for c in range(columns):
            right = min(c + reach, columns - 1)
            out[r, c] = max(
                max(level[r, c], level[r, right]),
                max(level[below, c], level[below, right]),
            )


@njit(cache=True, nogil=True)
def _score(level: NDArray[np.uint8], cells: NDArray[np.int32], dr: int, dc: int) -> int:
    rows, columns = level.shape
    total = 0
    for i in range(len(cells)):
        r, c = cells[i, 0] + dr, cells[i, 1] + dc
        if 0 <= r < rows and 0 <= c < columns:
            total += level[r, c]
    return total


@njit(cache=True, nogil=True)
def _push(
    stack: NDArray[np.int64], depth: int, level: int, angle: int, row: int, column: int, score: int
) -> None:
    # Assigned one by one: assigning a whole row takes two seconds longer to compile.
    stack[depth, 0], stack[depth, 1], stack[depth, 2] = level, angle, row
    stack[depth, 3], stack[depth, 4] = column, score


@njit(cache=True, nogil=True)
def branch_and_bound(
    pyramid: NDArray[np.uint8],
    cells: NDArray[np.int32],
    reach: int,
    floor: int,
    excluded: Exclusion,
    first_only: bool,
) -> tuple[int, int, int, int]:
    """Best (score, angle, row shift, column shift) with a score above ``floor``; score -1 when there is none.

    ``pyramid`` (L, rows, columns): level h holds maxima over blocks of 2^h cells, upper bounds of every score
    inside the block. ``cells`` (A, N, 2) are the points' cells at each angle, shifted so that the grid of
    level 0 begins ``2^(L-1)`` cells inside. Shifts range over [-reach, reach]. ``first_only`` returns the
    first leaf above the floor instead of the best.
    """
    top = len(pyramid) - 1
    step = 1 << top
    angles = len(cells)
    per_axis = (2 * reach) // step + 1
    count = angles * per_axis * per_axis
    scores = np.empty(count, dtype=np.int64)
    nodes = np.empty((count, 3), dtype=np.int64)
    k = 0
    for a in range(angles):
        for i in range(per_axis):
            for j in range(per_axis):
                dr, dc = -reach + i * step, -reach + j * step
                nodes[k, 0], nodes[k, 1], nodes[k, 2] = a, dr, dc
                scores[k] = _score(pyramid[top], cells[a], dr, dc)
                k += 1
    best, best_a, best_r, best_c = floor, -1, 0, 0
    stack = np.empty((4 * (top + 1) + 4, 5), dtype=np.int64)
    for k in np.argsort(-scores):
        if scores[k] <= best:
            break
        _push(stack, 0, top, nodes[k, 0], nodes[k, 1], nodes[k, 2], scores[k])
        depth = 1
        while depth > 0:
            depth -= 1
            h, a, dr, dc, score = stack[depth]
            if score <= best:
                continue
            if h == 0:
                if (
                    excluded.angle >= 0
                    and abs(a - excluded.angle) <= excluded.angles
                    and (dr - excluded.row) ** 2 + (dc - excluded.column) ** 2 <= excluded.cells**2
                ):
                    continue
                best, best_a, best_r, best_c = score, a, dr, dc
                if first_only:
                    return best, best_a, best_r, best_c
                continue
            half = 1 << (h - 1)
            first_child = depth
            for i in range(2):
                for j in range(2):
                    r, c = dr + i * half, dc + j * half
                    if r > reach or c > reach:
                        continue
                    child = _score(pyramid[h - 1], cells[a], r, c)
                    if child > best:
                        _push(stack, depth, h - 1, a, r, c, child)
                        depth += 1
            # The most promising child is visited first.
            for i in range(first_child + 1, depth):
                j = i
                while j > first_child and stack[j - 1, 4] > stack[j, 4]:
                    for m in range(5):
                        stack[j - 1, m], stack[j, m] = stack[j, m], stack[j - 1, m]
                    j -= 1
    return (best if best_a >= 0 else -1), best_a, best_r, best_c
