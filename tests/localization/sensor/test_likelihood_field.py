from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field import (
    BEYOND,
    CODES,
    DEPENDENCE,
    DEVIATION,
    FINEST,
    STEP,
    UNMAPPED,
    LikelihoodField,
    distance_codes,
    log_table,
)
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse, transform_points
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from tests.localization.scenes import MIDDLE, furnished, hall, points_at, points_from, ranges_from, rectangle
from tests.sensors.drives import BEARINGS

QUARTER = 0.0125  # metres: of cells of 5 cm
RESOLUTIONS = (0.02, 0.05, 0.1)
ON_FLOOR = np.array([9.03, 4.02, 0.4])


@cache
def floor(resolution: float, map_yaw: float = 0.0) -> OccupancyGrid:
    """18 m by 8 m, with a pillar, a cabinet and a way out; all walls on edges of the coarsest cells."""
    cells = np.full((round(8.0 / resolution), round(18.0 / resolution)), OCCUPIED, dtype=np.int8)

    def fill(left: float, low: float, right: float, high: float, value: int) -> None:
        edges = [round(metres / resolution) for metres in (left, low, right, high)]
        cells[edges[1] : edges[3], edges[0] : edges[2]] = value

    fill(0.4, 0.4, 17.6, 7.6, FREE)
    fill(11.0, 2.0, 11.6, 2.6, OCCUPIED)
    fill(4.0, 4.4, 7.6, 7.6, OCCUPIED)
    fill(14.0, 0.4, 14.2, 5.0, OCCUPIED)
    return OccupancyGrid(cells, resolution, np.array([3.0, -2.0, map_yaw]))


@cache
def field(resolution: float, map_yaw: float = 0.0) -> LikelihoodField:
    grid = floor(resolution, map_yaw)
    return LikelihoodField(Walls(grid), find_free_space(grid))


def computed_plainly(grid: OccupancyGrid, poses: Pose, points: EndPoints, nearer: float) -> np.ndarray:
    """(N,) sums over the end points of what the formula of the field says of the pixels that they are in.

    All walls count as some metres nearer, and there are walls all along the map's edges.
    """
    free_space, distances = find_free_space(grid), Walls(grid).distances
    grid_from_map, pixel = inverse(grid.map_from_grid), grid.resolution
    while pixel > FINEST + 1e-9:
        pixel /= 2.0
    totals = []
    for pose in poses:
        ends = transform_points(compose(grid_from_map, pose), points.in_base)[:, ::-1]
        middles = (np.floor(ends / pixel) + 0.5) * pixel
        metres = map_coordinates(distances, middles.T / grid.resolution - 0.5, order=1, mode="nearest")
        metres = metres - nearer
        is_outside = (ends < 0.0) | (ends >= np.array(distances.shape) * grid.resolution)
        metres[is_outside.any(axis=1)] = np.inf
        row, column = grid.cell_of(transform_points(pose, points.laser[None]))[0]
        on_map = 0 <= row < distances.shape[0] and 0 <= column < distances.shape[1]
        if not on_map or not free_space.is_standable[row, column]:
            metres[:] = np.inf
        steps = STEP * np.rint(metres / STEP)
        off = steps - QUARTER
        on_wall = np.where(steps < (CODES - 2) * STEP, np.exp(-0.5 * (off / DEVIATION) ** 2), 0.0)
        totals.append(np.log((1.0 - UNMAPPED) * on_wall + UNMAPPED).sum() / DEPENDENCE)
    return np.array(totals)


@settings(max_examples=30)
@given(
    st.floats(-2.0, 20.0),
    st.floats(-2.0, 10.0),
    st.floats(-3.1, 3.1),
    st.sampled_from([0.0, 0.5, -2.0, 3.1]),
    st.sampled_from(RESOLUTIONS),
)
def test_it_is_what_a_plain_computation_gives_anywhere_on_any_map(
    x: float, y: float, yaw: float, map_yaw: float, resolution: float
) -> None:
    """But for points on the edges of pixels and codes, which single precision puts into either."""
    grid = floor(resolution, map_yaw)
    points = points_from(grid, compose(grid.map_from_grid, ON_FLOOR))
    poses = compose(grid.map_from_grid, [x, y, yaw])
    poses = poses + [0.3, 0.3, 0.2] * np.random.default_rng(0).standard_normal((20, 3))
    found = field(resolution, map_yaw).log_likelihood(poses, points, QUARTER)
    least, most = (computed_plainly(grid, poses, points, nearer) for nearer in (-1e-6, 1e-6))
    off = np.maximum(found - most, least - found)
    assert np.median(off) < 0.01
    assert off.max() < 2.0


def test_on_a_map_that_ends_before_the_walls_a_scan_fits_best_where_it_was_taken() -> None:
    """Compared with places all over it, facing any way; half of the walls that the scan shows are missing."""
    whole, columns = floor(0.05), 56
    cropped = OccupancyGrid(whole.cells[:, columns:], 0.05, compose(whole.map_from_grid, [2.8, 0.0, 0.0]))
    free_space = find_free_space(cropped)
    truth = compose(whole.map_from_grid, [4.3, 3.0, np.pi])
    elsewhere = free_space.draw_poses(20_000, np.random.default_rng(0))
    elsewhere = elsewhere[np.hypot(*(elsewhere[:, :2] - truth[:2]).T) > 1.0]
    likelihood = LikelihoodField(Walls(cropped), free_space).log_likelihood(
        np.vstack([truth, elsewhere]), points_from(whole, truth), QUARTER
    )
    assert likelihood[0] > likelihood[1:].max()


def test_an_empty_scan_says_nothing() -> None:
    truth = compose(floor(0.05).map_from_grid, ON_FLOOR)
    nothing = points_at(np.full(len(BEARINGS), np.inf))
    assert field(0.05).log_likelihood(truth[None], nothing, QUARTER).tolist() == [0.0]
    assert len(field(0.05).fits(truth[None], nothing, QUARTER)) == 0


@settings(max_examples=30)
@given(st.floats(0.0, 1.0), st.integers(0, 1000))
def test_only_points_on_walls_fit(people: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = np.array(compose(floor(0.05).map_from_grid, ON_FLOOR))
    is_stopped = rng.random(len(BEARINGS)) < people
    ranges = np.where(
        is_stopped, 0.8, ranges_from(floor(0.05), truth)
    )  # within the room, more than 0.5 m from any wall
    fits = field(0.05).fits(truth[None], points_at(ranges), QUARTER)
    assert np.all(fits[is_stopped] < 0.05)
    assert np.all(fits[~is_stopped] > 0.8)


def test_from_inside_an_obstacle_that_was_moved_the_walls_behind_it_explain_the_scan() -> None:
    """Where the map has a box, the car drives, and sees the hall as if it were bare."""
    grid = furnished(hall(), rectangle(hall(), MIDDLE, 1.4, 1.0, 0.0))
    truth = compose(grid.map_from_grid, [*MIDDLE, 0.5])
    points = points_from(hall(), truth, IDENTITY)
    beside = compose(truth, [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -1.5, 0.0], [0.0, 0.0, 0.6]])
    moved = LikelihoodField(Walls(grid), find_free_space(grid))
    assert np.argmax(moved.log_likelihood(beside, points, QUARTER)) == 0
    assert moved.fits(truth[None], points, QUARTER).mean() > 0.9


@given(st.floats(0.02, 0.5))
def test_the_table_falls_from_a_wall_to_what_the_map_does_not_know(deviation: float) -> None:
    table = log_table(deviation, 0.0)
    assert table.shape == (256,)
    assert table[0] == 0.0
    assert np.all(np.diff(table[:-1]) <= 0.0)
    assert table[-2] == pytest.approx(np.log(UNMAPPED) / DEPENDENCE)
    assert table[-1] == pytest.approx(np.log(BEYOND) / DEPENDENCE)
    half_way = np.log((1.0 - UNMAPPED) * np.exp(-0.5) + UNMAPPED) / DEPENDENCE
    assert np.interp(deviation, STEP * np.arange(256), table) == pytest.approx(half_way, abs=0.01)


CELLS = (0.02, 0.025, 0.05, 0.1)
PIXELS = (0.01, 0.025, 0.05, 0.1, 0.25)


def wall_on_the_left(resolution: float) -> OccupancyGrid:
    """4 x 3 m, its first half metre occupied; the map frame is turned against the grid."""
    cells = np.full((round(3.0 / resolution), round(4.0 / resolution)), FREE, dtype=np.int8)
    cells[:, : round(0.5 / resolution)] = OCCUPIED
    return OccupancyGrid(cells, resolution, np.array([3.0, -2.0, 2.0]))


def codes_of(grid: OccupancyGrid, pixel: float) -> NDArray[np.uint8]:
    return distance_codes(Walls(grid), find_free_space(grid), pixel)


def from_the_wall(columns: int, pixel: float, resolution: float) -> NDArray[np.float64]:
    """(columns,) metres from the middles of pixels to the surface that the nearest cells of the wall have."""
    last_wall = 0.5 - resolution / 2.0
    return np.maximum((np.arange(columns) + 0.5) * pixel - last_wall, 0.0)


@pytest.mark.parametrize("resolution", CELLS)
@pytest.mark.parametrize("pixel", PIXELS)
def test_before_a_wall_codes_are_distances_whatever_the_cells(pixel: float, resolution: float) -> None:
    codes = codes_of(wall_on_the_left(resolution), pixel)
    rows, columns = codes.shape[0] - 2, codes.shape[1] - 2
    assert (rows, columns) == (round(3.0 / pixel), round(4.0 / pixel))
    expected = from_the_wall(columns, pixel, resolution)
    is_coded = (expected > 0.0) & (expected < (CODES - 2) * STEP)
    is_coded[-round(0.1 / pixel) - 1 :] = False  # beyond the middle of the last cell is nothing to go by
    coded = STEP * codes[1:-1, 1:-1]
    assert np.abs(coded[:, is_coded] - expected[is_coded]).max() < 0.51 * STEP + 1e-6
    assert np.all(coded[:, expected == 0.0] < 0.51 * STEP)


def test_beyond_the_map_is_no_wall() -> None:
    codes = codes_of(wall_on_the_left(0.05), 0.025)
    for edge in (codes[0], codes[-1], codes[:, 0], codes[:, -1]):
        assert np.all(edge >= CODES - 2)


def test_beyond_the_map_nothing_is_known_where_the_floor_goes_on() -> None:
    codes = codes_of(wall_on_the_left(0.05), 0.05)
    assert np.all(codes[1:-1, 0] == CODES - 2)
    assert np.all(codes[1:-1, -1] == CODES - 1)
    for edge in (codes[0], codes[-1]):
        assert np.all(edge[1:11] == CODES - 2)
        assert np.all(edge[12:-1] == CODES - 1)


@pytest.mark.parametrize("resolution", CELLS)
def test_the_field_is_never_coarser_than_its_finest_pixels_and_they_fill_cells(resolution: float) -> None:
    grid = wall_on_the_left(resolution)
    pixel = LikelihoodField(Walls(grid), find_free_space(grid)).pixel
    assert pixel <= FINEST + 1e-9
    assert resolution / pixel == pytest.approx(round(resolution / pixel))
