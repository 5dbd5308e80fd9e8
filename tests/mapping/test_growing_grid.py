import numpy as np
import pytest

from mapping.growing_grid import GrowingGrid
from mapping.rendering import Rays, render
from maps.occupancy_grid import UNKNOWN, OccupancyGrid
from maps.se2 import Pose

RESOLUTION = 0.05


@pytest.fixture
def drive() -> tuple[list[Rays], Pose]:
    """300 keyframes along a corridor 3 m wide with pillars, away from the origin and back."""
    rng = np.random.default_rng(0)
    rays, poses = [], []
    for i in range(300):
        x = 0.3 * min(i, 300 - i) - 7.0
        along = rng.uniform(-4.0, 4.0, 200)
        side = np.where(rng.random(200) < 0.5, 1.5, -1.5) + rng.normal(0.0, 0.01, 200)
        rays.append(Rays.to(np.column_stack([along, side]), 180))
        poses.append([x, 0.1 * np.sin(x), 0.01 * np.cos(x)])
    return rays, np.array(poses)


def assert_same(grown: OccupancyGrid, whole: OccupancyGrid) -> None:
    rows, columns = np.nonzero(whole.cells != UNKNOWN)
    cells = np.column_stack([rows, columns])
    there = grown.cell_of(whole.center_of(cells))
    assert grown.contains(there).all()
    found = grown.cells[there[:, 0], there[:, 1]]
    assert np.mean(np.abs(found.astype(int) - whole.cells[rows, columns]) <= 1) > 0.999
    assert np.count_nonzero(grown.cells != UNKNOWN) == pytest.approx(len(rows), rel=0.001)


@pytest.mark.parametrize("step", [1, 37])
def test_it_ends_in_the_grid_that_is_drawn_at_once(drive: tuple[list[Rays], Pose], step: int) -> None:
    rays, poses = drive
    growing = GrowingGrid(RESOLUTION)
    for count in [*range(1, len(rays), step), len(rays)]:
        grid = growing.draw(rays[:count], poses[:count])
    assert_same(grid, render(rays, poses, RESOLUTION))
    assert growing.redrawn == 0


def test_latest_keyframes_are_drawn_where_they_are_now(drive: tuple[list[Rays], Pose]) -> None:
    rays, poses = drive
    growing = GrowingGrid(RESOLUTION)
    moved = poses.copy()
    moved[-40:, :2] += 0.4
    growing.draw(rays, moved)
    assert_same(growing.draw(rays, poses), render(rays, poses, RESOLUTION))
    assert growing.redrawn == 0


def test_all_is_drawn_anew_when_a_loop_moves_it(drive: tuple[list[Rays], Pose]) -> None:
    rays, poses = drive
    growing = GrowingGrid(RESOLUTION)
    bent = poses.copy()
    bent[:, 1] += np.linspace(0.0, 2.0, len(bent))
    growing.draw(rays, bent)
    assert_same(growing.draw(rays, poses), render(rays, poses, RESOLUTION))
    assert growing.redrawn == 1


def test_a_grid_that_was_handed_out_stays_as_it_was(drive: tuple[list[Rays], Pose]) -> None:
    rays, poses = drive
    growing = GrowingGrid(RESOLUTION)
    first = growing.draw(rays[:100], poses[:100])
    before = first.cells.copy()
    growing.draw(rays, poses)
    assert np.array_equal(first.cells, before)
