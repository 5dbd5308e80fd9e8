"""The loops over particles and beams of the beam model."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.floor.laser_cell_kernels import laser_cell
from racecar.localization.numerics.prefetch_kernels import prefetch
from racecar.localization.numerics.trigonometry_kernels import BATCH, take_batch
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.ray_casting_kernels import cast_one

_PER_RADIAN = 2.0**16 / (2.0 * math.pi)
"""Angles count 2^16 to the turn, so that the low half of a word is the angle within a turn."""
_TWO_TURNS = 2.0 * 2.0**16
"""Added to angles, so that they are above zero before they are cut to whole numbers."""
_CACHE_BYTES = 16_000_000
"""Particles whose rows of the table together take more are asked for ahead, since they do not fit into the
processor's cache; a cloud's do."""
_AHEAD = 4
"""Particles by which their rows are asked for before they are read, since a load from memory takes about as
long as so many rows' sums."""
_CACHE_LINE = 64
"""Bytes, by definition of x86-64 and of ARM's 64-bit cores."""
_NEAR = 10.0
"""Cells; beside a viewpoint, shorter beams count as so long, since the parallax of a laser up to two cells
aside is linear in the offset only beyond a few times that."""
_VECTOR = 8
"""Numbers that the processor works on at once: beams are padded to a multiple, so that none is left over."""
_COLUMN_BITS, _COLUMN_MASK = np.uint32(12), np.uint32(0xFFF)
"""Of a word that holds a column of the table of ranges (up to 4096 headings) and a place in that of
log-probabilities, so that fewer instructions take both from where they are computed to where they are
used."""


@njit(cache=True, nogil=True, fastmath={"contract"})
def add_up_beams(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
    viewpoints: NDArray[np.float32],
    ranges: NDArray[np.uint8],
    aims: NDArray[np.float32],
    readings: NDArray[np.int64],
    log_probabilities: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(N,) sum over beams of the log-probability of the code of the expected range, for particles (N, 3).

    ``laser_on_base`` is x, y; ``grid_in_map`` x, y, cos and sin of the grid's origin and cells per metre;
    ``aims`` are as `aim` gives them, with their places in ``log_probabilities``, whose columns are the codes
    between two margins, and of which ``readings`` (B,) are rows. A particle off the table gets the sum of the
    least likely codes. One particle after the other, for the beams of one lie in one row of the table.
    """
    rows, headings, offsets = _locate(map_from_base, laser_on_base, grid_in_map, cell_index, viewpoints)
    is_large = len(rows) * ranges.shape[1] > _CACHE_BYTES
    beams, per_turn = len(readings), np.uint32(ranges.shape[1])
    log_probability = log_probabilities.ravel()
    words = np.empty(aims.shape[1], dtype=np.uint32)
    totals = np.empty(len(rows))
    outside = 1.0  # summed up when a particle needs it
    for i in range(len(rows)):
        if is_large and i + _AHEAD < len(rows):
            _prefetch_row(rows[i + _AHEAD], headings[i + _AHEAD], aims[0, :beams], ranges)
        if rows[i] < 0:
            if outside > 0.0:
                outside = _least_of(readings, log_probabilities)
            totals[i] = outside
            continue
        left, ahead, seen = offsets[0, i], offsets[1, i], ranges[rows[i]]
        for beam in range(len(words)):
            words[beam] = _word_of(headings[i], left, ahead, aims, beam, per_turn)
        even = np.float32(0.0)  # two sums, for each addition waits for the one before
        odd = np.float32(0.0)
        for beam in range(0, beams // 2 * 2, 2):
            word, next_word = words[beam], words[beam + 1]
            even += log_probability[(word >> _COLUMN_BITS) + seen[word & _COLUMN_MASK]]
            odd += log_probability[(next_word >> _COLUMN_BITS) + seen[next_word & _COLUMN_MASK]]
        for beam in range(beams // 2 * 2, beams):
            even += log_probability[(words[beam] >> _COLUMN_BITS) + seen[words[beam] & _COLUMN_MASK]]
        totals[i] = even + odd
    return totals


@njit(cache=True, nogil=True, fastmath={"contract"})
def expected_ranges(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
    viewpoints: NDArray[np.float32],
    ranges: NDArray[np.uint8],
    aims: NDArray[np.float32],
    beams: int,
    range_of_code: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, B) ranges of the codes whose probabilities `add_up_beams` takes; nan off the table.

    ``aims`` (6, ``beams`` and padding) have their places in ``range_of_code``: the codes between two margins.
    """
    rows, headings, offsets = _locate(map_from_base, laser_on_base, grid_in_map, cell_index, viewpoints)
    per_turn = np.uint32(ranges.shape[1])
    words = np.empty(aims.shape[1], dtype=np.uint32)
    expected = np.full((len(rows), beams), np.nan)
    for i in range(len(rows)):
        if rows[i] < 0:
            continue
        left, ahead, seen = offsets[0, i], offsets[1, i], ranges[rows[i]]
        for beam in range(len(words)):
            words[beam] = _word_of(headings[i], left, ahead, aims, beam, per_turn)
        for beam in range(beams):
            word = words[beam]
            expected[i, beam] = range_of_code[(word >> _COLUMN_BITS) + seen[word & _COLUMN_MASK]]
    return expected


@njit(cache=True, nogil=True)
def are_near(
    expected: NDArray[np.float64], ranges: NDArray[np.float64], longest: float, metres: float, share: float
) -> NDArray[np.bool_]:
    """(N, B) whether ranges (B,) are within metres and a share of themselves of those expected (N, B).

    Ranges are clipped to the ``longest`` that can be expected, and near that any longer one is expected too.
    """
    least, most = np.empty(len(ranges)), np.empty(len(ranges))
    for beam in range(len(ranges)):
        measured = min(ranges[beam], longest)
        within = metres + share * measured
        least[beam] = measured - within
        most[beam] = measured + within if measured + within < longest else math.inf
    near = np.empty(expected.shape, dtype=np.bool_)
    for i in range(len(expected)):
        for beam in range(len(ranges)):
            near[i, beam] = (least[beam] <= expected[i, beam]) & (expected[i, beam] <= most[beam])
    return near


@njit(cache=True, nogil=True)
def aim(
    bearings: NDArray[np.float64],
    turn: float,
    ranges: NDArray[np.float64],
    resolution: float,
    steps_per_cell: float,
    codes_per_cell: NDArray[np.float64],
    places: NDArray[np.int64],
    columns: int,
) -> NDArray[np.float32]:
    """Beams (6, B) as the loops need them: bearing with 2^16 to the turn, its parallax, place, its parallax.

    The laser is turned by ``turn`` on the base, less the grid's yaw; ``codes_per_cell`` (S + 1,) is how many
    codes a range of one cell more is, at each number of steps. ``places`` (B,) are where code 0 of each
    reading is among the log-probabilities, and ``columns`` how many the table of ranges has. The parallax is,
    for each cell that the laser is to the left of a viewpoint, and for each that it is ahead of it, how much
    farther a beam must turn to end at the same place, and how many codes less it reads. Zeros pad the rows.
    """
    aims = np.zeros((6, -(-len(bearings) // _VECTOR) * _VECTOR), dtype=np.float32)
    to_round = 2.0**15 / columns + _TWO_TURNS  # to the nearest column, and from above zero
    farthest = (len(codes_per_cell) - 1) / steps_per_cell
    for beam in range(len(bearings)):
        reading = min(max(ranges[beam] / resolution, _NEAR), farthest)
        step = min(int(reading * steps_per_cell), len(codes_per_cell) - 1)
        direction = turn + bearings[beam]
        cos, sin = math.cos(direction), math.sin(direction)
        aims[0, beam] = direction * _PER_RADIAN + to_round
        aims[1, beam] = cos / reading * _PER_RADIAN
        aims[2, beam] = -sin / reading * _PER_RADIAN
        aims[3, beam] = places[beam] + 0.5  # is rounded with its parallax
        aims[4, beam] = -sin * codes_per_cell[step]
        aims[5, beam] = -cos * codes_per_cell[step]
    return aims


@njit(cache=True, nogil=True)
def _locate(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
    viewpoints: NDArray[np.float32],
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    """Rows of the table (N,) where the lasers are, negative off it, and headings (N,) with 2^16 to the turn.

    And (2, N) cells that they are to the left of and ahead of the viewpoints, seen along the base.
    """
    rows = np.empty(len(map_from_base), dtype=np.int64)
    headings = np.empty(len(map_from_base), dtype=np.float32)
    offsets = np.zeros((2, len(map_from_base)), dtype=np.float32)
    yaw, sine, cosine = np.empty(BATCH), np.empty(BATCH), np.empty(BATCH)
    for start in range(0, len(map_from_base), BATCH):
        count = take_batch(map_from_base, start, yaw, sine, cosine)
        for k in range(count):
            x, y = map_from_base[start + k, 0], map_from_base[start + k, 1]
            up, right = laser_cell(x, y, cosine[k], sine[k], laser_on_base, grid_in_map)
            row, column = math.floor(up), math.floor(right)
            is_inside = 0 <= row < cell_index.shape[0] and 0 <= column < cell_index.shape[1]
            viewpoint = cell_index[row, column] if is_inside else -1
            if viewpoint >= 0:
                right -= viewpoints[viewpoint, 1]
                up -= viewpoints[viewpoint, 0]
                offsets[0, start + k] = cosine[k] * up - sine[k] * right
                offsets[1, start + k] = cosine[k] * right + sine[k] * up
            rows[start + k] = viewpoint
            headings[start + k] = yaw[k] * _PER_RADIAN
    return rows, headings, offsets


@njit(cache=True, nogil=True, inline="always")
def _word_of(
    heading: np.float32,
    left: np.float32,
    ahead: np.float32,
    aims: NDArray[np.float32],
    beam: int,
    per_turn: np.uint32,
) -> np.uint32:
    """The place of the code 0 of a beam, and its column in the table of ranges, of ``per_turn``.

    So it is for one that ends as it does, from so far to the left and ahead of the viewpoint.
    """
    place = np.int32(aims[3, beam] + left * aims[4, beam] + ahead * aims[5, beam])
    turned = np.int32(heading + aims[0, beam] + left * aims[1, beam] + ahead * aims[2, beam])
    column = np.uint32((np.uint32(turned) & np.uint32(0xFFFF)) * per_turn) >> np.uint32(16)
    return np.uint32(np.uint32(place) << _COLUMN_BITS) | column


@njit(cache=True, nogil=True)
def _least_of(readings: NDArray[np.int64], log_probabilities: NDArray[np.float32]) -> float:
    """The sum of the least of the rows that are read."""
    total = 0.0
    for reading in readings:
        least = log_probabilities[reading, 0]
        for code in range(log_probabilities.shape[1]):
            least = min(least, log_probabilities[reading, code])
        total += least
    return total


@njit(cache=True, nogil=True)
def _prefetch_row(
    row: int, heading: np.float32, bearings: NDArray[np.float32], ranges: NDArray[np.uint8]
) -> None:
    """Ask for a row of the table, if it is one, from the first beam's cache line to the last one's."""
    if row < 0:
        return
    per_turn = ranges.shape[1]
    swept = (np.int64(bearings[-1] - bearings[0]) & 0xFFFF) * per_turn >> 16
    first = (np.int64(heading + bearings[0]) & 0xFFFF) * per_turn >> 16
    end = first + swept + _CACHE_LINE
    for column in range(first, min(end, per_turn), _CACHE_LINE):
        prefetch(ranges, row, column)
    for column in range(0, end - per_turn, _CACHE_LINE):
        prefetch(ranges, row, column)


@njit(cache=True, nogil=True)
def add_up_cast_beams(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    is_standable: NDArray[np.bool_],
    cells: NDArray[np.int8],
    is_movable: NDArray[np.bool_],
    cells_without_movable: NDArray[np.int8],
    bearings: NDArray[np.float64],
    readings: NDArray[np.int64],
    log_probabilities: NDArray[np.float32],
    code_of_steps: NDArray[np.uint8],
    steps_per_cell: float,
    margin: int,
) -> NDArray[np.float64]:
    """(N,) the same from rays through the grid; ``bearings`` (B,) are radians."""
    longest = len(code_of_steps) - 1
    farthest = longest / steps_per_cell
    outside = _least_of(readings, log_probabilities)
    totals = np.empty(len(map_from_base))
    for i in range(len(map_from_base)):
        x, y, yaw = map_from_base[i]
        row, column = laser_cell(x, y, math.cos(yaw), math.sin(yaw), laser_on_base, grid_in_map)
        totals[i] = outside
        if not (0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]):
            continue
        if not is_standable[int(row), int(column)]:
            continue
        seen = cells_without_movable if is_movable[int(row), int(column)] else cells
        total = np.float32(0.0)
        for beam in range(len(bearings)):
            direction = yaw + bearings[beam]
            reach = cast_one(seen, row, column, math.sin(direction), math.cos(direction), farthest)
            code = code_of_steps[int(min(reach * steps_per_cell, longest) + 0.5)]
            total += log_probabilities[readings[beam], margin + code]
        totals[i] = total
    return totals
