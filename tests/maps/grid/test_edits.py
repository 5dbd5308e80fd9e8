"""Edits are drawn where they are meant, whatever way the grid lies, and change no other cell."""

from collections.abc import Callable

import numpy as np
import pytest

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.edits import Edit, EditKind, covered, edited, keepout_mask, speed_mask
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

RESOLUTION = 0.05
SQUARE = np.array([[1.0, 0.5], [2.0, 0.5], [2.0, 1.5], [1.0, 1.5]])
POSES = [np.zeros(3), np.array([3.0, -2.0, 0.7])]


def grid_at(map_from_grid: np.ndarray) -> OccupancyGrid:
    """4 m by 3 m; each third column free, occupied, unknown."""
    cells = np.tile(np.array([FREE, OCCUPIED, UNKNOWN], dtype=np.int8), (60, 27))[:, :80]
    return OccupancyGrid(cells.copy(), RESOLUTION, map_from_grid)


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
    keepout = keepout_mask(grid, edits).cells
    assert np.all(keepout[10:30, 20:40] == OCCUPIED)
    assert keepout.sum() == 400 * OCCUPIED
    mask, unit = speed_mask(grid, edits)
    assert np.all(mask.cells[10:30, 20:40] == 25)
    assert unit * 25 == pytest.approx(0.5)
    mask, unit = speed_mask(grid, [*edits[:2], edit("speed", half, grid, limit=0.1)])
    assert unit * mask.cells[15, 22] == pytest.approx(0.1)
    assert unit * mask.cells[15, 35] == pytest.approx(0.5)
    assert mask.cells[5, 5] == 0
