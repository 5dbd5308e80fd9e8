"""Point-to-line matching of two polar scans: the inner loops.

Small arrays are copied one number after the other: NumPy's ways to do it take seconds to compile.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2_kernels import composed, inverse_of_symmetric, step_between

TABLE_SIZE = 360
"""Bearing bins of the look-up table, one per degree, since few beams of a scan then share a bin. The table
has one entry more, so that a bin's end is the next one's start."""

UNIT = 2**15 - 1
"""The length of a normal, the largest number of 16 bits: normals are kept so because it halves their
memory."""

_FINAL_DISTANCE, _SHRINKAGE = 0.15, 0.7
"""Metres within which partners are searched for in the end, and by what factor the distance shrinks with each
iteration. Measured in a prototype on aces, fr079 and intel; from the usual initial distance in four."""
_MIN_NORMAL_AGREEMENT = 0.7
"""Cosine of the angle between the normals of partners, at least, so that the two sides of a thin wall, or the
two walls of a corner, are none: 45 degrees."""
NORMAL_VARIANCE = 0.01
"""Square radians by which a normal's direction errs: what noisy normals pretend to know along a bare
corridor, per unit of weight. By judgement: normals err by six degrees."""
_MAX_ITERATIONS = 12
"""Steps of Gauss-Newton at most. By judgement: most matches end sooner, by their small steps."""
_MIN_TERMS = 6.0
"""Points with a partner, summed over the scans of a match, below which the pose is left as it is. By
judgement: twice the three unknowns."""
_LITTLE = 0.003
"""Metres by which points may move before their partners are sought again, since below that nothing changes
but the time: a quarter of it, as measured on aces, fr079 and intel."""
_FAR = 10.0
"""Metres at which all points are taken to be when a turn is counted as a movement: indoors few are farther,
so that hardly one moves by more than `_LITTLE` unnoticed."""
_SPARE = 0.05
"""Metres beyond the distance of partners that are searched too, so that a point without one need not be
looked for again until it has moved so far. It changes the time and no match, since what it skips is known to
be empty."""
_DAMPING = 1e-3
"""Of the sum of weights, added to the diagonal of the normal equations (Levenberg, 1944), so that a direction
that no line observes takes no step."""
_SMALL_STEP = 1e-4
"""Metres and radians of a step after which a match has ended, since lasers measure ten times as coarsely."""
_NO_WEIGHT = 1e-9
"""Sum of weights that stands for none, so that a match without a point has a residual of zero."""

_ANY_ORDER = {"reassoc", "arcp", "contract", "nsz"}
"""Sums may be worked out in any order, which takes a tenth off the time; infinities and NaN stay what they
are (LLVM's flags)."""

_FloatArray = NDArray[np.float32]
_Normals = NDArray[np.int16]
_Matrix = NDArray[np.float64]


class MatchChoices(NamedTuple):
    """What the caller of a match says."""

    initial_distance: float
    kernel_width: float
    both_ways: bool
    """Whether points of the fixed scans are laid on lines of the moving ones too."""


class PackedScans(NamedTuple):
    """R scans of at most N points each."""

    points: _FloatArray
    """(R, N, 2) metres, ascending in bearing."""
    normals: _Normals
    """(R, N, 2) of length `UNIT`, (0, 0) where a point has none."""
    counts: NDArray[np.int32]
    """(R,) of the points that are meant."""
    tables: NDArray[np.int16]
    """(R, TABLE_SIZE + 1) as `fill_bearing_table` leaves them."""


class PairedRows(NamedTuple):
    """P pairs of scans that are matched jointly."""

    rows: NDArray[np.int64]
    """(P, 2) of the fixed scan and of the moving one, among their packed scans."""
    fixed_poses: _Matrix
    """(P, 3) of the fixed scan in the fixed frame."""
    moving_poses: _Matrix
    """(P, 3) of the moving scan in the frame of the moving group."""


class _PolarScan(NamedTuple):
    """One of `PackedScans`."""

    points: _FloatArray
    normals: _Normals
    size: int
    """Of its points, those that are meant."""
    table: NDArray[np.int16]


class _Partners(NamedTuple):
    """What is known of the N points of a source from the iterations before."""

    nearest: NDArray[np.int16]
    """(N,) the target point that was nearest, -1 for none."""
    alone: _FloatArray
    """(N, 3) a place in the target's frame, and a distance within which no target point lies about it."""


class _Frames(NamedTuple):
    """Where the two scans of a pair lie."""

    target_from_source: _Matrix
    moving: _Matrix
    """(3,) the moving scan in the frame of the moving group."""
    is_forward: bool
    """Whether the source is the scan that moves."""


class _NormalEquations(NamedTuple):
    """Weighted sums over all point-to-line terms; the step is (x, y, yaw) in the frame of the moving
    group."""

    xx: float
    xy: float
    x_yaw: float
    yy: float
    y_yaw: float
    yaw_yaw: float
    x: float
    """Of the gradient, like the next two."""
    y: float
    yaw: float
    weight: float
    squared: float
    """Of the residuals."""
    terms: float
    points: float
    """That could have had a term."""


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def fill_bearing_table(points: _FloatArray, table: NDArray[np.int16]) -> None:
    """For each bearing bin the index of the first point (N, 2), sorted by bearing, that is not before it."""
    index = 0
    for bin_ in range(TABLE_SIZE + 1):
        start = -np.pi + bin_ * (2.0 * np.pi / TABLE_SIZE)
        while index < len(points) and np.arctan2(points[index, 1], points[index, 0]) < start:
            index += 1
        table[bin_] = index


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def first_by_bearing(x: float, y: float, table: NDArray[np.int16]) -> int:
    """Index of a point near the bearing of (x, y), by the look-up table."""
    bin_ = int((np.arctan2(y, x) + np.pi) * (TABLE_SIZE / (2.0 * np.pi)))
    return int(table[min(max(bin_, 0), TABLE_SIZE)])


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def nearest_from(
    start: int, x: float, y: float, points: _FloatArray, count: int, max_distance: float
) -> tuple[int, float]:
    """Index of the point nearest to (x, y) within ``max_distance``, -1 if none, and how far it is, squared.

    Points are sorted by bearing. Those after ``start``, which is within half a turn, and then those before it
    are looked at, until they lie so far to the side that none beyond can be nearer; those across the seam
    behind the sensor are not.
    """
    best, best_squared = -1, max_distance * max_distance
    for step in (1, -1):
        j = start if step == 1 else start - 1
        while 0 <= j < count:
            px, py = np.float64(points[j, 0]), np.float64(points[j, 1])
            squared = (px - x) * (px - x) + (py - y) * (py - y)
            if squared < best_squared:
                best, best_squared = j, squared
            beside = step * (x * py - y * px)
            if beside > 0.0 and (
                beside * beside > best_squared * (px * px + py * py)
                or (x * px + y * py < 0.0 and x * x + y * y > best_squared)
            ):
                break
            j += step
    return best, best_squared


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def _is_alone(x: float, y: float, alone: _FloatArray, max_distance: float) -> bool:
    """Is (x, y) still so near to where it was ``alone`` (3,) that no point lies within ``max_distance``?"""
    spare = alone[2] - max_distance
    dx, dy = x - alone[0], y - alone[1]
    return bool(spare > 0.0 and dx * dx + dy * dy < spare * spare)


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def _with_terms(
    sums: _NormalEquations,
    partners: _Partners,
    source: _PolarScan,
    target: _PolarScan,
    frames: _Frames,
    max_distance: float,
    is_new: bool,
    choices: MatchChoices,
) -> _NormalEquations:
    """The sums with the point-to-line terms of one pair of scans, in one direction, added.

    Partners up to ``max_distance`` are sought where ``is_new``, else those of the last time taken again."""
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw, gx, gy, gyaw, weights, squares, terms, points = sums
    c, s = np.cos(frames.target_from_source[2]), np.sin(frames.target_from_source[2])
    tx, ty = frames.target_from_source[0], frames.target_from_source[1]
    moving, kernel_width = frames.moving, choices.kernel_width
    mc, ms = np.cos(moving[2]), np.sin(moving[2])
    for i in range(source.size):
        px, py = np.float64(source.points[i, 0]), np.float64(source.points[i, 1])
        points += 1.0
        x, y = c * px - s * py + tx, s * px + c * py + ty
        j = int(partners.nearest[i])
        if is_new:
            if j < 0 and _is_alone(x, y, partners.alone[i], max_distance):
                continue
            start = j if j >= 0 else first_by_bearing(x, y, target.table)
            j, squared = nearest_from(start, x, y, target.points, target.size, max_distance + _SPARE)
            if squared > max_distance * max_distance:
                j = -1
                partners.alone[i, 0], partners.alone[i, 1] = x, y
                partners.alone[i, 2] = np.sqrt(squared)
            partners.nearest[i] = j
        if j < 0:
            continue
        nx, ny = target.normals[j, 0] / UNIT, target.normals[j, 1] / UNIT
        if nx == 0.0 and ny == 0.0:
            continue
        # The target's normal seen from the source.
        ax, ay = c * nx + s * ny, -s * nx + c * ny
        sx, sy = source.normals[i, 0] / UNIT, source.normals[i, 1] / UNIT
        if (sx != 0.0 or sy != 0.0) and ax * sx + ay * sy < _MIN_NORMAL_AGREEMENT:
            continue
        residual = nx * (x - target.points[j, 0]) + ny * (y - target.points[j, 1])
        ratio = kernel_width * kernel_width / (kernel_width * kernel_width + residual * residual)
        weight = ratio * ratio
        # Normal and lever arm in the frame of the moving group, where the step is taken.
        if frames.is_forward:
            j0, j1 = mc * ax - ms * ay, ms * ax + mc * ay
            lx, ly = mc * px - ms * py + moving[0], ms * px + mc * py + moving[1]
        else:
            j0, j1 = -(mc * nx - ms * ny), -(ms * nx + mc * ny)
            lx, ly = mc * x - ms * y + moving[0], ms * x + mc * y + moving[1]
        j2 = j1 * lx - j0 * ly
        xx += weight * j0 * j0
        xy += weight * j0 * j1
        x_yaw += weight * j0 * j2
        yy += weight * j1 * j1
        y_yaw += weight * j1 * j2
        yaw_yaw += weight * j2 * j2
        gx += weight * j0 * residual
        gy += weight * j1 * residual
        gyaw += weight * j2 * residual
        weights += weight
        squares += weight * residual * residual
        terms += 1.0
    return _NormalEquations(
        xx, xy, x_yaw, yy, y_yaw, yaw_yaw, gx, gy, gyaw, weights, squares, terms, points
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def remove_sliding(hessian: _Matrix, gradient: _Matrix, weight: float) -> None:
    """Take the direction along which the surfaces let the scan slide out of the normal equations.

    Along a bare corridor the translational information is not zero but what noisy normals pretend:
    their variance (square radians) times the sum of weights. That much is subtracted from the smaller
    eigenvalue, by shrinking the Jacobian along its eigenvector.
    """
    a, b, d = hessian[0, 0], hessian[0, 1], hessian[1, 1]
    mean, half = 0.5 * (a + d), 0.5 * (a - d)
    root = np.sqrt(half * half + b * b)
    small = mean - root
    kept = small - NORMAL_VARIANCE * weight
    shrink = 0.0
    if kept > 0.0 and small > 0.0:
        shrink = np.sqrt(kept / small)
    angle = 0.5 * np.arctan2(2.0 * b, a - d) + 0.5 * np.pi
    # The projection (p, q; q, r) that leaves ``shrink`` of the eigenvector, from both sides.
    x, y = np.cos(angle), np.sin(angle)
    p, q, r = 1.0 - (1.0 - shrink) * x * x, (shrink - 1.0) * x * y, 1.0 - (1.0 - shrink) * y * y
    hessian[0, 0] = p * (p * a + q * b) + q * (p * b + q * d)
    hessian[0, 1] = hessian[1, 0] = q * (p * a + q * b) + r * (p * b + q * d)
    hessian[1, 1] = q * (q * a + r * b) + r * (q * b + r * d)
    for vector in (hessian[2], gradient):
        vector[0], vector[1] = p * vector[0] + q * vector[1], q * vector[0] + r * vector[1]
    hessian[0, 2], hessian[1, 2] = hessian[2, 0], hessian[2, 1]


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def _scan_of(scans: PackedScans, row: int) -> _PolarScan:
    return _PolarScan(scans.points[row], scans.normals[row], scans.counts[row], scans.tables[row])


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def match_group(
    pose: _Matrix,
    pairs: PairedRows,
    prior_information: _Matrix,
    targets: PackedScans,
    sources: PackedScans,
    choices: MatchChoices,
    hessian: _Matrix,
    quality: _Matrix,
) -> None:
    """Move ``pose`` (3,), fixed_from_moving, to where the moving scans' points lie on the fixed ones' lines
    and, where both ways are asked for, the fixed ones' on the moving ones'.

    The fixed scans are among ``targets``, the moving ones among ``sources``. Iteratively reweighted
    Gauss-Newton on SE(2) with the step on the right, Geman-McClure weights, and a correspondence distance
    that shrinks; ``prior_information`` (3, 3) ties the pose to where it started. ``hessian`` (3, 3) is left
    in the tangent frame of the moving group, for residuals of unit variance; ``quality`` (3,) as the share of
    points that found a partner, the weighted root mean square residual and the sum of weights."""
    sums = _NormalEquations(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    gradient, regular, step = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    start = pose.copy()
    distance = choices.initial_distance
    count, most = len(pairs.rows), targets.points.shape[1]
    nearest = np.empty((2, count, most), dtype=np.int16)
    nearest[:] = -1
    alone = np.zeros((2, count, most, 3), dtype=np.float32)
    moved_since = np.inf
    for _ in range(_MAX_ITERATIONS):
        is_new = distance > _FINAL_DISTANCE or moved_since > _LITTLE
        if is_new:
            moved_since = 0.0
        sums = _NormalEquations(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for k in range(count):
            target, source = _scan_of(targets, pairs.rows[k, 0]), _scan_of(sources, pairs.rows[k, 1])
            moving = pairs.moving_poses[k]
            target_from_source = step_between(pairs.fixed_poses[k], composed(pose, moving))
            frames = _Frames(target_from_source, moving, True)
            partners = _Partners(nearest[0, k], alone[0, k])
            sums = _with_terms(sums, partners, source, target, frames, distance, is_new, choices)
            if not choices.both_ways:
                continue
            source_from_target = step_between(target_from_source, np.zeros(3))
            frames = _Frames(source_from_target, moving, False)
            partners = _Partners(nearest[1, k], alone[1, k])
            sums = _with_terms(sums, partners, target, source, frames, distance, is_new, choices)
        hessian[0, 0], hessian[0, 1], hessian[0, 2] = sums.xx, sums.xy, sums.x_yaw
        hessian[1, 0], hessian[1, 1], hessian[1, 2] = sums.xy, sums.yy, sums.y_yaw
        hessian[2, 0], hessian[2, 1], hessian[2, 2] = sums.x_yaw, sums.y_yaw, sums.yaw_yaw
        gradient[0], gradient[1], gradient[2] = sums.x, sums.y, sums.yaw
        remove_sliding(hessian, gradient, sums.weight)
        if sums.terms < _MIN_TERMS:
            break
        off = step_between(start, pose)
        for i in range(3):
            for j in range(3):
                regular[i, j] = hessian[i, j] + prior_information[i, j]
                gradient[i] += prior_information[i, j] * off[j]
            regular[i, i] += _DAMPING * sums.weight
        uncertainty = inverse_of_symmetric(regular)
        for i in range(3):
            step[i] = 0.0
            for j in range(3):
                step[i] -= uncertainty[i, j] * gradient[j]
        moved = composed(pose, step)
        for i in range(3):
            pose[i] = moved[i]
        moved_since += abs(step[0]) + abs(step[1]) + _FAR * abs(step[2])
        is_still = abs(step[0]) + abs(step[1]) < _SMALL_STEP and abs(step[2]) < _SMALL_STEP
        if is_still and distance <= _FINAL_DISTANCE:
            break
        distance = max(_FINAL_DISTANCE, _SHRINKAGE * distance)
    quality[0] = sums.terms / max(sums.points, 1.0)
    quality[1] = np.sqrt(sums.squared / max(sums.weight, _NO_WEIGHT))
    quality[2] = sums.weight


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def match_groups(
    poses: _Matrix,
    starts: NDArray[np.int64],
    pairs: PairedRows,
    prior_information: _Matrix,
    targets: PackedScans,
    sources: PackedScans,
    choices: MatchChoices,
    hessians: _Matrix,
    qualities: _Matrix,
) -> None:
    """``match_group`` for G groups: group g owns rows ``starts[g]`` to ``starts[g + 1]`` of ``pairs``."""
    for g in range(len(poses)):
        a, b = starts[g], starts[g + 1]
        own = PairedRows(pairs.rows[a:b], pairs.fixed_poses[a:b], pairs.moving_poses[a:b])
        match_group(poses[g], own, prior_information, targets, sources, choices, hessians[g], qualities[g])
