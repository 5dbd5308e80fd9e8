"""Point-to-line matching of two polar scans: the inner loops.

Small arrays are copied one number after the other: NumPy's ways to do it take seconds to compile.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2_kernels import composed, step_between
from racecar.maps.geometry.symmetric_kernels import inverse_of_symmetric

TABLE_SIZE = 360
"""Bearing bins of the look-up table; it has one entry more, so that a bin's end is the next one's start."""

UNIT = 2**15 - 1
"""The length of a normal: its numbers are 16 bits long, which is half the memory."""

WIDEST_LINE = 0.05
"""Variance across a line that its points may have, as a share of that along it."""
FITS, WIDENING = 4, 1.5
"""How often a line is tried, each time through points of a reach so much wider."""
USUAL_NOISE = 0.015
"""Metres."""

NARROWEST = 0.15
"""Metres within which partners are sought in the end."""
MIN_NORMAL_DOT = 0.7
SLIDING_FLOOR = 0.01
MAX_ITERATIONS = 12

LITTLE = 0.003
"""Metres by which points may move before their partners are sought again; for a turn they are all taken to be
``FAR`` metres away."""
FAR = 10.0
SPARE = 0.05
"""Metres beyond the distance of partners that are searched too: until a point without one has moved so far,
it need not be looked for again."""

_FloatArray = NDArray[np.float32]
_Normals = NDArray[np.int16]
_Matrix = NDArray[np.float64]


@njit(cache=True, nogil=True)
def fill_bearing_table(points: _FloatArray, table: NDArray[np.int16]) -> None:
    """For each bearing bin the index of the first point (N, 2), sorted by bearing, that is not before it."""
    index = 0
    for bin_ in range(TABLE_SIZE + 1):
        start = -np.pi + bin_ * (2.0 * np.pi / TABLE_SIZE)
        while index < len(points) and np.arctan2(points[index, 1], points[index, 0]) < start:
            index += 1
        table[bin_] = index


@njit(cache=True, nogil=True)
def _neighbours(
    points: _FloatArray, i: int, reach: float, max_gap: float
) -> tuple[int, float, float, float, float, float]:
    """Count of the points about point ``i``, their mean (x, y) seen from it and covariance (xx, xy, yy).

    On both sides they are taken up to ``reach``, two at least, and not beyond a jump from one surface to
    another.
    """
    count = 1
    sx = sy = sxx = sxy = syy = 0.0
    for direction in (-1, 1):
        last_x = last_y = 0.0
        taken = 0
        j = i + direction
        while 0 <= j < len(points):
            x, y = np.float64(points[j, 0] - points[i, 0]), np.float64(points[j, 1] - points[i, 1])
            if (x - last_x) ** 2 + (y - last_y) ** 2 > max_gap * max_gap:
                break
            if taken >= 2 and x * x + y * y > reach * reach:
                break
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
            last_x, last_y = x, y
            taken += 1
            j += direction
        count += taken
    mx, my = sx / count, sy / count
    return count, mx, my, sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my


@njit(cache=True, nogil=True)
def fit_lines(
    points: _FloatArray,
    half_angle: float,
    half_width: float,
    max_gap_angle: float,
    min_gap: float,
    max_rms: float,
    on_lines: _FloatArray,
    normals: _FloatArray,
) -> None:
    """Lines through points (N, 2) sorted by bearing and their neighbours, which span ``half_angle`` and
    ``half_width`` to each side; where noise leaves them no direction, up to three times as much.

    ``on_lines`` (N, 2) are the points moved towards their lines: all the way where they scatter far more than
    ``USUAL_NOISE``, hardly where less. ``normals`` (N, 2) look towards the sensor; where a surface is not
    straight they are (0, 0), and its points stay.
    """
    for i in range(len(points)):
        for axis in range(2):
            on_lines[i, axis] = points[i, axis]
            normals[i, axis] = 0.0
        px, py = np.float64(points[i, 0]), np.float64(points[i, 1])
        distance = np.sqrt(px * px + py * py)
        max_gap = max(min_gap, distance * max_gap_angle)
        reach = max(half_width, distance * half_angle)
        for _ in range(FITS):
            count, mx, my, cxx, cxy, cyy = _neighbours(points, i, reach, max_gap)
            mean, half = 0.5 * (cxx + cyy), 0.5 * (cxx - cyy)
            root = np.sqrt(half * half + cxy * cxy)
            small, large = max(mean - root, 0.0), mean + root
            if count < 4 or small > max_rms * max_rms:
                break
            if small > WIDEST_LINE * large:
                reach *= WIDENING
                continue
            angle = 0.5 * np.arctan2(2.0 * cxy, cxx - cyy) + 0.5 * np.pi
            nx, ny = np.cos(angle), np.sin(angle)
            if nx * px + ny * py > 0.0:
                nx, ny = -nx, -ny
            off = (nx * mx + ny * my) * small / (small + USUAL_NOISE * USUAL_NOISE)
            on_lines[i, 0], on_lines[i, 1] = px + off * nx, py + off * ny
            normals[i, 0], normals[i, 1] = nx, ny
            break


@njit(cache=True, nogil=True)
def first_by_bearing(x: float, y: float, table: NDArray[np.int16]) -> int:
    """Index of a point near the bearing of (x, y), by the look-up table."""
    bin_ = int((np.arctan2(y, x) + np.pi) * (TABLE_SIZE / (2.0 * np.pi)))
    return int(table[min(max(bin_, 0), TABLE_SIZE)])


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _is_alone(x: float, y: float, alone: _FloatArray, max_distance: float) -> bool:
    """Is (x, y) still so near to where it was ``alone`` (3,) that no point lies within ``max_distance``?"""
    spare = alone[2] - max_distance
    dx, dy = x - alone[0], y - alone[1]
    return bool(spare > 0.0 and dx * dx + dy * dy < spare * spare)


@njit(cache=True, nogil=True)
def _accumulate(
    sums: _Matrix,
    partners: NDArray[np.int16],
    alone: _FloatArray,
    target_from_source: _Matrix,
    moving: _Matrix,
    forward: bool,
    source: _FloatArray,
    source_normals: _Normals,
    source_count: int,
    target: _FloatArray,
    target_normals: _Normals,
    target_count: int,
    target_table: NDArray[np.int16],
    max_distance: float,
    kernel_width: float,
    seek: bool,
) -> None:
    """Add the point-to-line terms of one pair of scans, in one direction, to ``sums``.

    ``sums`` holds the upper triangle of the Hessian (6), the gradient (3), the sum of weights, of
    weighted squared residuals, of terms, and of points that could have had one. ``partners`` (N,) holds the
    target point that was nearest to each source point, -1 for none; ``alone`` (N, 3) a place in the target's
    frame, and a distance within which no target point lies about it. ``moving`` is the pose of the moving
    scan in the moving group; ``forward`` tells whether the source is the scan that moves, and ``seek``
    whether partners are sought or those of the last time taken again.
    """
    c, s, tx, ty = (
        np.cos(target_from_source[2]),
        np.sin(target_from_source[2]),
        target_from_source[0],
        target_from_source[1],
    )
    mc, ms = np.cos(moving[2]), np.sin(moving[2])
    for i in range(source_count):
        px, py = np.float64(source[i, 0]), np.float64(source[i, 1])
        sums[12] += 1.0
        x, y = c * px - s * py + tx, s * px + c * py + ty
        j = int(partners[i])
        if seek:
            if j < 0 and _is_alone(x, y, alone[i], max_distance):
                continue
            start = j if j >= 0 else first_by_bearing(x, y, target_table)
            j, squared = nearest_from(start, x, y, target, target_count, max_distance + SPARE)
            if squared > max_distance * max_distance:
                j = -1
                alone[i, 0], alone[i, 1], alone[i, 2] = x, y, np.sqrt(squared)
            partners[i] = j
        if j < 0:
            continue
        nx, ny = target_normals[j, 0] / UNIT, target_normals[j, 1] / UNIT
        if nx == 0.0 and ny == 0.0:
            continue
        # The target's normal seen from the source.
        ax, ay = c * nx + s * ny, -s * nx + c * ny
        sx, sy = source_normals[i, 0] / UNIT, source_normals[i, 1] / UNIT
        if (sx != 0.0 or sy != 0.0) and ax * sx + ay * sy < MIN_NORMAL_DOT:
            continue
        residual = nx * (x - target[j, 0]) + ny * (y - target[j, 1])
        ratio = kernel_width * kernel_width / (kernel_width * kernel_width + residual * residual)
        weight = ratio * ratio
        # Normal and lever arm in the frame of the moving group, where the step is taken.
        if forward:
            j0, j1 = mc * ax - ms * ay, ms * ax + mc * ay
            lx, ly = mc * px - ms * py + moving[0], ms * px + mc * py + moving[1]
        else:
            j0, j1 = -(mc * nx - ms * ny), -(ms * nx + mc * ny)
            lx, ly = mc * x - ms * y + moving[0], ms * x + mc * y + moving[1]
        j2 = j1 * lx - j0 * ly
        sums[0] += weight * j0 * j0
        sums[1] += weight * j0 * j1
        sums[2] += weight * j0 * j2
        sums[3] += weight * j1 * j1
        sums[4] += weight * j1 * j2
        sums[5] += weight * j2 * j2
        sums[6] += weight * j0 * residual
        sums[7] += weight * j1 * residual
        sums[8] += weight * j2 * residual
        sums[9] += weight
        sums[10] += weight * residual * residual
        sums[11] += 1.0


@njit(cache=True, nogil=True)
def remove_sliding(hessian: _Matrix, gradient: _Matrix, weight: float) -> None:
    """Take the direction along which the surfaces let the scan slide out of the normal equations.

    Along a bare corridor the translational information is not zero but what noisy normals pretend:
    their variance times the sum of weights. That much (``SLIDING_FLOOR`` × weight) is subtracted from the
    smaller eigenvalue, by shrinking the Jacobian along its eigenvector.
    """
    a, b, d = hessian[0, 0], hessian[0, 1], hessian[1, 1]
    mean, half = 0.5 * (a + d), 0.5 * (a - d)
    root = np.sqrt(half * half + b * b)
    small = mean - root
    kept = small - SLIDING_FLOOR * weight
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


@njit(cache=True, nogil=True)
def match_group(
    pose: _Matrix,
    pairs: NDArray[np.int64],
    fixed_poses: _Matrix,
    moving_poses: _Matrix,
    prior_information: _Matrix,
    targets: tuple[_FloatArray, _Normals, NDArray[np.int32], NDArray[np.int16]],
    sources: tuple[_FloatArray, _Normals, NDArray[np.int32], NDArray[np.int16]],
    widest: float,
    kernel_width: float,
    both_ways: bool,
    hessian: _Matrix,
    quality: _Matrix,
) -> None:
    """Move ``pose`` (3,), fixed_from_moving, to where the moving scans' points lie on the fixed ones' lines
    and, ``both_ways``, the fixed ones' on the moving ones'.

    Row k of ``pairs`` names a fixed scan among ``targets`` at ``fixed_poses[k]`` and a moving one among
    ``sources`` at ``moving_poses[k]``, each in its own group's frame. Iteratively reweighted Gauss-Newton
    on SE(2) with the step on the right, Geman-McClure weights, and a correspondence distance that shrinks
    from ``widest`` to ``NARROWEST``; ``prior_information`` (3, 3) ties the pose to where it started.
    ``hessian`` (3, 3) is left in the tangent frame of the moving group, for residuals of unit variance;
    ``quality`` (3,) as the share of points that found a partner, the weighted root mean square residual
    and the sum of weights.
    """
    points_t, normals_t, counts_t, tables_t = targets
    points_s, normals_s, counts_s, tables_s = sources
    sums = np.zeros(13)
    gradient, regular, step = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    start = pose.copy()
    distance = widest
    partners = np.empty((2, len(pairs), points_t.shape[1]), dtype=np.int16)
    partners[:] = -1
    alone = np.zeros((2, len(pairs), points_t.shape[1], 3), dtype=np.float32)
    moved_since = np.inf
    for _ in range(MAX_ITERATIONS):
        seek = distance > NARROWEST or moved_since > LITTLE
        if seek:
            moved_since = 0.0
        sums[:] = 0.0
        for k in range(len(pairs)):
            t, s = pairs[k, 0], pairs[k, 1]
            target_from_source = step_between(fixed_poses[k], composed(pose, moving_poses[k]))
            _accumulate(
                sums, partners[0, k], alone[0, k], target_from_source, moving_poses[k], True,
                points_s[s], normals_s[s], counts_s[s],
                points_t[t], normals_t[t], counts_t[t], tables_t[t],
                distance, kernel_width, seek,
            )  # fmt: skip
            if not both_ways:
                continue
            source_from_target = step_between(target_from_source, np.zeros(3))
            _accumulate(
                sums, partners[1, k], alone[1, k], source_from_target, moving_poses[k], False,
                points_t[t], normals_t[t], counts_t[t],
                points_s[s], normals_s[s], counts_s[s], tables_s[s],
                distance, kernel_width, seek,
            )  # fmt: skip
        hessian[0, 0], hessian[0, 1], hessian[0, 2] = sums[0], sums[1], sums[2]
        hessian[1, 0], hessian[1, 1], hessian[1, 2] = sums[1], sums[3], sums[4]
        hessian[2, 0], hessian[2, 1], hessian[2, 2] = sums[2], sums[4], sums[5]
        gradient[0], gradient[1], gradient[2] = sums[6], sums[7], sums[8]
        remove_sliding(hessian, gradient, sums[9])
        if sums[11] < 6.0:
            break
        off = step_between(start, pose)
        for i in range(3):
            for j in range(3):
                regular[i, j] = hessian[i, j] + prior_information[i, j]
                gradient[i] += prior_information[i, j] * off[j]
            regular[i, i] += 1e-3 * sums[9]
        uncertainty = inverse_of_symmetric(regular)
        for i in range(3):
            step[i] = 0.0
            for j in range(3):
                step[i] -= uncertainty[i, j] * gradient[j]
        moved = composed(pose, step)
        for i in range(3):
            pose[i] = moved[i]
        moved_since += abs(step[0]) + abs(step[1]) + FAR * abs(step[2])
        settled = abs(step[0]) + abs(step[1]) < 1e-4 and abs(step[2]) < 1e-4
        if settled and distance <= NARROWEST:
            break
        distance = max(NARROWEST, 0.7 * distance)
    quality[0] = sums[11] / max(sums[12], 1.0)
    quality[1] = np.sqrt(sums[10] / max(sums[9], 1e-9))
    quality[2] = sums[9]


@njit(cache=True, nogil=True)
def match_groups(
    poses: _Matrix,
    starts: NDArray[np.int64],
    pairs: NDArray[np.int64],
    fixed_poses: _Matrix,
    moving_poses: _Matrix,
    prior_information: _Matrix,
    targets: tuple[_FloatArray, _Normals, NDArray[np.int32], NDArray[np.int16]],
    sources: tuple[_FloatArray, _Normals, NDArray[np.int32], NDArray[np.int16]],
    widest: float,
    kernel_width: float,
    both_ways: bool,
    hessians: _Matrix,
    qualities: _Matrix,
) -> None:
    """``match_group`` for G groups: group g owns rows ``starts[g]`` to ``starts[g + 1]`` of ``pairs``."""
    for g in range(len(poses)):
        a, b = starts[g], starts[g + 1]
        match_group(
            poses[g], pairs[a:b], fixed_poses[a:b], moving_poses[a:b], prior_information, targets, sources,
            widest, kernel_width, both_ways, hessians[g], qualities[g],
        )  # fmt: skip
