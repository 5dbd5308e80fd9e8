"""In tiles the same map is drawn as without, to the bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.despeckling import despeckled
from racecar.mapping.grid.near_path import near_path
from racecar.mapping.grid.rendering import Box, Rays, render
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.tiled_grid import TILE, TiledGrid
from tests.mapping.grid.untiled import untiled, untiled_despeckled, untiled_near_path
from tests.mapping.sessions import one_drive
from tests.maps.grid.tiles import in_tiles

RESOLUTION = 0.05
WIDE = 2.5 * TILE * RESOLUTION
"""Metres over which places are spread: several tiles."""


def scans(seed: int, count: int) -> tuple[list[Rays], Pose]:
    """From anywhere, with some ends on the corners of cells, some misses, and some that see nothing."""
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-WIDE, WIDE, (count, 2)), rng.uniform(-np.pi, np.pi, count)])
    poses[::3, :2] = np.round(poses[::3, :2] / RESOLUTION) * RESOLUTION
    poses[::3, 2] = np.round(poses[::3, 2] / (np.pi / 2)) * (np.pi / 2)
    rays = []
    for _ in range(count):
        ends = rng.uniform(-8.0, 8.0, (int(rng.integers(0, 30)), 2))
        ends[::2] = np.round(ends[::2] / RESOLUTION) * RESOLUTION
        rays.append(Rays.to(ends, int(rng.integers(0, len(ends) + 1))))
    return rays, poses


boxes = st.one_of(
    st.none(),
    st.tuples(st.floats(-WIDE, 0.0), st.floats(-WIDE, 0.0), st.floats(0.1, WIDE), st.floats(0.1, WIDE)).map(
        lambda sides: (np.array(sides[:2]), np.array(sides[2:]))
    ),
)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 12), boxes, st.sampled_from([0.0, 1.0]))
def test_scans_draw_the_same_cells(seed: int, count: int, box: Box | None, margin: float) -> None:
    rays, poses = scans(seed, count)
    rays[0], poses[0, :2] = Rays.to(np.array([[3.0, 0.2], [1.0, 4.0]]), 1), 0.0  # in each box
    config = RenderingConfig(margin=margin)
    grid = render(rays, poses, one_drive(len(rays)), RESOLUTION, config, box)
    expected = untiled(rays, poses, RESOLUTION, config, box)
    np.testing.assert_array_equal(grid.map_from_grid, expected.map_from_grid)
    np.testing.assert_array_equal(grid.in_one_piece().cells, expected.cells)


def test_a_wall_beyond_the_box_ends_no_miss_that_comes_into_it() -> None:
    """Cells beyond it are not counted, though they lie in a tile with some that are."""
    along = np.linspace(-1.0, 1.0, 81)
    wall = Rays.to(np.column_stack([np.full(81, 2.02), along]), 81)
    misses = Rays.to(np.column_stack([np.full(81, 4.9), along]), 0)
    rays, poses = [*[wall] * 6, misses], np.zeros((7, 3))
    box = np.array([3.0, -0.5]), np.array([4.5, 0.5])
    grid = render(rays, poses, one_drive(len(rays)), RESOLUTION, RenderingConfig(), box).in_one_piece()
    expected = untiled(rays, poses, RESOLUTION, RenderingConfig(), box)
    assert np.mean(expected.cells != UNKNOWN) > 0.9
    np.testing.assert_array_equal(grid.cells, expected.cells)


def specked(seed: int) -> OccupancyGrid:
    """Specks, lines and open floor over several tiles, many of them about the corners of tiles."""
    rng = np.random.default_rng(seed)
    cells = np.full((2 * TILE + 90, 2 * TILE + 40), FREE, dtype=np.int8)
    cells[:, TILE + 100 :] = UNKNOWN
    for _ in range(60):
        row, column = rng.integers(0, cells.shape)
        if rng.random() < 0.5:
            row, column = TILE + rng.integers(-14, 15, 2)
        height, width = rng.integers(1, 16, 2)
        cells[row : row + height, column : column + width] = rng.choice(
            [FREE, OCCUPIED, 60], (height, width)
        )[: len(cells) - row, : cells.shape[1] - column]
    return OccupancyGrid(cells, RESOLUTION, np.array([1.0, -2.0, 0.3]))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 40), st.sampled_from([0.05, 0.3, 0.6, 1.0]))
def test_the_same_specks_go(seed: int, keyframes: int, largest: float) -> None:
    grid, rng = specked(seed), np.random.default_rng(seed)
    occupied = grid.center_of(np.argwhere(grid.cells >= 50))
    seen = [occupied[rng.random(len(occupied)) < 0.03] + rng.choice([0.0, 99.0]) for _ in range(keyframes)]
    cleaned = despeckled(in_tiles(grid), iter(seen), keyframes, largest).in_one_piece()
    np.testing.assert_array_equal(cleaned.cells, untiled_despeckled(grid, seen, largest))


@pytest.mark.parametrize(
    ("length", "times", "stays"), [(8, 3, False), (8, 20, True), (40, 3, True), (1, 1, False)]
)
def test_only_what_is_small_and_hardly_seen_goes(length: int, times: int, stays: bool) -> None:
    """Cells, and keyframes of thirty."""
    grid = OccupancyGrid(np.zeros((200, 200), dtype=np.int8), RESOLUTION, np.array([1.0, -2.0, 0.3]))
    grid.cells[100, 100 : 100 + length] = OCCUPIED
    blob = grid.center_of(np.argwhere(grid.cells == OCCUPIED))
    seen = [blob if k < times else blob[:0] for k in range(30)]
    cleaned = despeckled(in_tiles(grid), seen, 30, 0.6).in_one_piece()
    left = grid.cells if stays else np.where(grid.cells == OCCUPIED, UNKNOWN, grid.cells)
    np.testing.assert_array_equal(cleaned.cells, left)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.01, 40.0))
def test_the_same_cells_are_near_the_path(seed: int, margin: float) -> None:
    grid, rng = specked(seed), np.random.default_rng(seed)
    path = grid.center_of(rng.integers(0, grid.shape, (int(rng.integers(1, 9)), 2)))
    near = near_path(in_tiles(grid), path, margin).in_one_piece()
    np.testing.assert_array_equal(near.cells, untiled_near_path(grid, path, margin))


@given(st.integers(0, 2**32), st.tuples(*[st.integers(-300, 700)] * 2), st.tuples(*[st.integers(0, 600)] * 2))
@settings(max_examples=40, deadline=None)
def test_a_window_shows_the_cells_that_lie_there(
    seed: int, first: tuple[int, int], size: tuple[int, int]
) -> None:
    grid = specked(seed)
    tiled = in_tiles(grid)
    rows, columns = (slice(begin, begin + length) for begin, length in zip(first, size, strict=True))
    around = np.pad(grid.cells, 1400, constant_values=UNKNOWN)
    expected = around[rows.start + 1400 : rows.stop + 1400, columns.start + 1400 : columns.stop + 1400]
    np.testing.assert_array_equal(tiled.window(rows, columns), expected)


def test_what_was_seen_takes_memory_and_what_lies_between_does_not() -> None:
    """Two rooms a thousand kilometres apart."""
    rays = [Rays.to(np.array([[2.0, 1.0], [-1.0, 3.0]]), 2)] * 2
    poses = np.array([[0.0, 0.0, 0.0], [1e6, 1e5, 1.0]])
    grid = render(rays, poses, one_drive(len(rays)), 1.0, RenderingConfig())
    assert grid.width > 1_000_000
    assert len(grid.tiles) <= 8
    rows, columns = grid.cell_of(poses[:, :2]).T
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        assert grid.window(slice(row, row + 1), slice(column, column + 1))[0, 0] > UNKNOWN


def test_a_grid_too_large_for_one_piece_is_refused_with_the_cells_that_would_do() -> None:
    grid = TiledGrid({}, 40_000, 40_000, 0.05, np.zeros(3))
    with pytest.raises(UserError, match=r"40000 × 40000 cells .* cells of 0\.07 m"):
        grid.in_one_piece()
