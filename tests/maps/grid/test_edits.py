"""Edits are drawn where they are meant, whatever way the grid lies, and change no other cell."""

from collections.abc import Callable

import numpy as np
import pytest

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid import edits as tiled_edits
from racecar.maps.grid.edits import Edit, EditKind, keepout_mask, speed_mask
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.tiled_grid import TILE
from tests.maps.grid.tiles import in_tiles

RESOLUTION = 0.05
SQUARE = np.array([[1.0, 0.5], [2.0, 0.5], [2.0, 1.5], [1.0, 1.5]])
POSES = [np.zeros(3), np.array([3.0, -2.0, 0.7])]


def grid_at(map_from_grid: np.ndarray) -> OccupancyGrid:
    """4 m by 3 m; each third column free, occupied, unknown."""
    cells = np.tile(np.array([FREE, OCCUPIED, UNKNOWN], dtype=np.int8), (60, 27))[:, :80]
    return OccupancyGrid(cells.copy(), RESOLUTION, map_from_grid)


def edited(grid: OccupancyGrid, edits: list[Edit]) -> OccupancyGrid:
    return tiled_edits.edited(in_tiles(grid), edits).in_one_piece()


def covered(grid: OccupancyGrid, edit: Edit) -> np.ndarray:
    area = np.zeros(grid.shape, dtype=np.bool_)
    for tile, part in tiled_edits.covered(in_tiles(grid), edit):
        row, column = tile.first_cell
        here = area[row : row + TILE, column : column + TILE]
        here |= part[: here.shape[0], : here.shape[1]]
    return area


def edit(kind: EditKind, in_grid: np.ndarray, grid: OccupancyGrid, **more: float) -> Edit:
    return Edit(kind, transform_points(grid.map_from_grid, in_grid), **more)


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("erase", lambda cells: np.where(cells == UNKNOWN, UNKNOWN, FREE)),
        ("free", lambda cells: np.full_like(cells, FREE)),
        ("unknown", lambda cells: np.full_like(cells, UNKNOWN)),
        ("keepout", lambda cells: cells),
    ],
)
def test_an_area_changes_and_nothing_else(
    pose: np.ndarray, kind: EditKind, expected: Callable[[np.ndarray], np.ndarray]
) -> None:
    grid = grid_at(pose)
    changed = edited(grid, [edit(kind, SQUARE, grid)])
    wanted = grid.cells.copy()
    wanted[10:30, 20:40] = expected(wanted[10:30, 20:40])
    np.testing.assert_array_equal(changed.cells, wanted)
    assert grid.cells[10, 21] == grid_at(pose).cells[10, 21]


def test_later_edits_lie_over_earlier_ones() -> None:
    grid = grid_at(POSES[1])
    edits = [edit("unknown", SQUARE, grid), edit("wall", SQUARE[:2] + 0.01, grid)]
    assert np.all(edited(grid, edits).cells[10, 20:40] == OCCUPIED)
    assert np.all(edited(grid, edits[::-1]).cells[10, 20:40] == UNKNOWN)


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 17))
def test_no_ray_passes_a_drawn_wall(angle: float) -> None:
    grid = OccupancyGrid(np.zeros((80, 80), dtype=np.int8), RESOLUTION, np.zeros(3))
    middle, along = np.array([2.013, 1.987]), np.array([np.cos(angle), np.sin(angle)])
    wall = edited(grid, [Edit("wall", np.array([middle - 1.5 * along, middle + 1.5 * along]))])
    across = np.array([-along[1], along[0]])
    for off in np.linspace(-1.2, 1.2, 41):
        start = middle + off * along - 0.4 * across
        steps = np.linspace(0.0, 0.8, 4000)[:, None]
        rows, columns = wall.cell_of(start + steps * across).T
        assert np.any(wall.cells[rows, columns] == OCCUPIED)


def test_a_wall_is_as_wide_as_it_is_meant_to_be() -> None:
    grid = OccupancyGrid(np.zeros((80, 80), dtype=np.int8), RESOLUTION, POSES[1])
    thick = edit("wall", np.array([[1.0, 2.0], [3.0, 2.0]]), grid, width=0.4)
    rows, columns = np.nonzero(covered(grid, thick))
    assert (rows.min(), rows.max()) == (36, 43)
    assert (columns.min(), columns.max()) in ((20, 59), (20, 60), (19, 59))


def test_a_closed_wide_wall_leaves_its_inside() -> None:
    grid = OccupancyGrid(np.zeros((80, 80), dtype=np.int8), RESOLUTION, np.zeros(3))
    ring = np.concatenate([SQUARE, SQUARE[:1]])
    area = covered(grid, Edit("wall", ring, width=0.2))
    assert area[10, 30]
    assert not area[20, 30]


def test_what_lies_outside_covers_nothing() -> None:
    grid = grid_at(POSES[0])
    far = Edit("wall", SQUARE + 100.0, width=0.2)
    assert not covered(grid, far).any()
    assert not covered(grid, Edit("wall", SQUARE + 100.0)).any()
    assert not covered(grid, Edit("free", SQUARE + 100.0)).any()


def test_masks_show_keepout_areas_and_the_lowest_limit() -> None:
    grid = grid_at(POSES[1])
    half = SQUARE * [0.5, 1.0] + [0.5, 0.0]  # columns 20 to 30
    edits = [
        edit("keepout", SQUARE, grid),
        edit("speed", SQUARE, grid, limit=0.5),
        edit("speed", half, grid, limit=2.0),
        edit("wall", SQUARE, grid),
    ]

    def limits(edits: list[Edit]) -> tuple[OccupancyGrid, float]:
        mask, unit = speed_mask(in_tiles(grid), edits)
        return mask.in_one_piece(), unit

    keepout = keepout_mask(in_tiles(grid), edits).in_one_piece().cells
    assert np.all(keepout[10:30, 20:40] == OCCUPIED)
    assert keepout.sum() == 400 * OCCUPIED
    mask, unit = limits(edits)
    assert np.all(mask.cells[10:30, 20:40] == 25)
    assert unit * 25 == pytest.approx(0.5)
    mask, unit = limits([*edits[:2], edit("speed", half, grid, limit=0.1)])
    assert unit * mask.cells[15, 22] == pytest.approx(0.1)
    assert unit * mask.cells[15, 35] == pytest.approx(0.5)
    assert mask.cells[5, 5] == 0


@pytest.mark.parametrize("kind", ["wall", "unknown"])
def test_what_spans_several_tiles_is_drawn_in_each(kind: EditKind) -> None:
    """Where nothing was seen, too."""
    grid = OccupancyGrid(np.full((700, 900), UNKNOWN, dtype=np.int8), RESOLUTION, POSES[1])
    grid.cells[300:, 300:] = FREE
    corners = np.array([[0.5, 0.5], [44.0, 3.0], [40.0, 34.0], [3.0, 30.0]])
    drawn = edited(grid, [edit(kind, corners, grid, width=0.3)])
    rows, columns = np.indices(grid.shape)
    places = np.column_stack([columns.ravel() + 0.5, rows.ravel() + 0.5]) * RESOLUTION
    from shapely import LineString, Polygon, points

    shape = LineString(corners).buffer(0.15, cap_style="flat") if kind == "wall" else Polygon(corners)
    is_in = np.array(shape.buffer(-0.1).contains(points(places))).reshape(grid.shape)
    is_out = np.array(shape.buffer(0.1).disjoint(points(places))).reshape(grid.shape)
    assert is_in.sum() > 3000
    assert np.all(drawn.cells[is_in] == (OCCUPIED if kind == "wall" else UNKNOWN))
    np.testing.assert_array_equal(drawn.cells[is_out], grid.cells[is_out])
