"""Point-to-line matching of two polar scans: the inner loops.

Small arrays are copied element by element: NumPy's ways take seconds to compile.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2_kernels import composed, inverse_of_symmetric, step_between

TABLE_SIZE = 360
"""Bearing bins of the look-up table, one per degree, since then few beams of a scan share a bin. One extra
entry marks the end of the last bin."""

UNIT = 2**15 - 1
"""Length of a normal, the largest 16-bit number: normals are stored so because it halves their memory."""

_FINAL_DISTANCE, _SHRINKAGE = 0.15, 0.7
"""Final correspondence distance in metres, and the factor by which it shrinks per iteration. Measured in a
prototype on aces, fr079 and intel; reached from the default in four iterations."""
_MIN_NORMAL_AGREEMENT = 0.7
"""Minimum cosine of the angle between normals of a correspondence, 45 degrees, so that the two sides of a
thin wall or the two walls of a corner are never matched."""
NORMAL_VARIANCE = 0.01
"""Variance of a normal's direction in square radians: the spurious information of noisy normals along a bare
corridor, per unit of weight. Chosen by judgement: normals err by six degrees."""
_MAX_ITERATIONS = 12
"""Maximum number of Gauss-Newton steps. Chosen by judgement: most matches converge sooner."""
_MIN_TERMS = 6.0
"""Minimum number of correspondences over all scans of a match; with fewer the pose is kept. Chosen by
judgement: twice the three unknowns."""
_LITTLE = 0.003
"""Metres by which points may move before correspondences are searched again, since below that only the time
changes: a quarter less, as measured on aces, fr079 and intel."""
_FAR = 10.0
"""Assumed range of all points, in metres, when a rotation is converted to a displacement: indoors few are
farther, so that hardly one moves by more than `_LITTLE` unnoticed."""
_SPARE = 0.05
"""Extra metres of search radius, so that a point without a correspondence is not searched again before it has
moved that far. Affects only the time, since what it skips is known to be empty."""
_DAMPING = 1e-3
"""Share of the sum of weights, added to the diagonal of the normal equations (Levenberg, 1944), so that
unobserved directions take no step."""
_SMALL_STEP = 1e-4
"""Convergence threshold in metres and radians, since lasers measure ten times as coarsely."""
_NO_WEIGHT = 1e-9
"""Lower bound of the sum of weights, so that a match without points has a residual of zero."""

_ANY_ORDER = {"reassoc", "arcp", "contract", "nsz"}
"""Allow reordering of sums, which saves a tenth of the time; infinities and NaN are respected (LLVM's
flags)."""

_FloatArray = NDArray[np.float32]
_Normals = NDArray[np.int16]
_Matrix = NDArray[np.float64]


class MatchChoices(NamedTuple):
    """Options of a match."""

    initial_distance: float
    kernel_width: float
    both_ways: bool
    """Whether points of the fixed scans are also matched to lines of the moving ones."""


class PackedScans(NamedTuple):
    """R scans of at most N points each."""

    points: _FloatArray
    """(R, N, 2) metres, in ascending order of bearing."""
    normals: _Normals
    """(R, N, 2) of length `UNIT`, (0, 0) where a point has none."""
    counts: NDArray[np.int32]
    """(R,) number of valid points."""
    tables: NDArray[np.int16]
    """(R, TABLE_SIZE + 1) from `fill_bearing_table`."""


class PairedRows(NamedTuple):
    """P pairs of scans that are matched together."""

    rows: NDArray[np.int64]
    """(P, 2) indices of the fixed and the moving scan among their packed scans."""
    fixed_poses: _Matrix
    """(P, 3) pose of the fixed scan in the fixed frame."""
    moving_poses: _Matrix
    """(P, 3) pose of the moving scan in the frame of the moving group."""


class _PolarScan(NamedTuple):
    """One of `PackedScans`."""

    points: _FloatArray
    normals: _Normals
    size: int
    """Number of valid points."""
    table: NDArray[np.int16]


class _Partners(NamedTuple):
    """Correspondences of the N source points from earlier iterations."""

    nearest: NDArray[np.int16]
    """(N,) nearest target point, -1 for none."""
    alone: _FloatArray
    """(N, 3) a position in the target's frame, and the radius around it without target points."""


class _Frames(NamedTuple):
    """Relative poses of the two scans of a pair."""

    target_from_source: _Matrix
    moving: _Matrix
    """(3,) pose of the moving scan in the frame of the moving group."""
    is_forward: bool
    """Whether the source is the moving scan."""


class _NormalEquations(NamedTuple):
    """Weighted sums over all point-to-line terms for a step (x, y, yaw) in the frame of the moving group."""

    xx: float
    xy: float
    x_yaw: float
    yy: float
    y_yaw: float
    yaw_yaw: float
    x: float
    """Gradient, with the next two."""
    y: float
    yaw: float
    weight: float
    squared: float
    """Weighted sum of squared residuals."""
    terms: float
    points: float
    """Number of points that could have a correspondence."""


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def fill_bearing_table(points: _FloatArray, table: NDArray[np.int16]) -> None:
    """Fill a table with the index of the first point (N, 2), sorted by bearing, at or after each bin."""
    index = 0
    for bin_ in range(TABLE_SIZE + 1):
        start = -np.pi + bin_ * (2.0 * np.pi / TABLE_SIZE)
        while index < len(points) and np.arctan2(points[index, 1], points[index, 0]) < start:
            index += 1
        table[bin_] = index


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def first_by_bearing(x: float, y: float, table: NDArray[np.int16]) -> int:
    """Index of a point near the bearing of (x, y), from the look-up table."""
    bin_ = int((np.arctan2(y, x) + np.pi) * (TABLE_SIZE / (2.0 * np.pi)))
    return int(table[min(max(bin_, 0), TABLE_SIZE)])


@njit(cache=True, nogil=True, fastmath=_ANY_ORDER)
def nearest_from(
    start: int, x: float, y: float, points: _FloatArray, count: int, max_distance: float
) -> tuple[int, float]:
    """Index of the point nearest to (x, y) within ``max_distance``, -1 if none, and its squared distance.

    Points are sorted by bearing; ``start`` is within half a turn. Points after it, then before it are scanned
    until the lateral distance rules out any nearer one. The seam behind the sensor is not crossed.
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
    """Whether (x, y) is so close to its place in ``alone`` (3,) that no point is within ``max_distance``."""
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
    """The sums plus the point-to-line terms of one pair of scans in one direction. Correspondences up to
    ``max_distance`` are searched if ``is_new``, else those of the last iteration reused."""
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
        # Normal of the target in the source's frame.
        ax, ay = c * nx + s * ny, -s * nx + c * ny
        sx, sy = source.normals[i, 0] / UNIT, source.normals[i, 1] / UNIT
        if (sx != 0.0 or sy != 0.0) and ax * sx + ay * sy < _MIN_NORMAL_AGREEMENT:
            continue
        residual = nx * (x - target.points[j, 0]) + ny * (y - target.points[j, 1])
        ratio = kernel_width * kernel_width / (kernel_width * kernel_width + residual * residual)
        weight = ratio * ratio
        # Normal and lever arm in the frame of the moving group, in which the step is taken.
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
    """Remove the degenerate direction, along which the scan can slide, from the normal equations.

    Along a bare corridor, noisy normals still contribute translational information: their variance (square
    radians) times the sum of weights. It is subtracted from the smaller eigenvalue by shrinking the Jacobian
    along its eigenvector.
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
    # The projection (p, q; q, r), applied from both sides, keeps ``shrink`` of the eigenvector.
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
    """Optimize ``pose`` (3,), fixed_from_moving, in place: align moving scans' points with fixed scans'
    lines.

    Iteratively reweighted Gauss-Newton on SE(2) with right increments, Geman-McClure weights and a shrinking
    correspondence distance. ``prior_information`` (3, 3) is that of the initial pose; ``targets`` hold the
    fixed scans, ``sources`` the moving ones. Fills ``hessian`` (3, 3) in the tangent frame of the moving
    group, for unit variance, and ``quality`` (3,): matched share, residual in metres, sum of weights.
    """
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
    """`match_group` for G groups: group g owns rows ``starts[g]`` to ``starts[g + 1]`` of ``pairs``."""
    for g in range(len(poses)):
        a, b = starts[g], starts[g + 1]
        own = PairedRows(pairs.rows[a:b], pairs.fixed_poses[a:b], pairs.moving_poses[a:b])
        match_group(poses[g], own, prior_information, targets, sources, choices, hessians[g], qualities[g])
