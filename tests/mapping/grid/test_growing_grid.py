"""The grid of a drive that goes on is that of all keyframes so far."""

import numpy as np
import pytest

from racecar.mapping.grid import growing_grid as growing_grid_module
from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.grid.rendering import render as render_with
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import FREE_THRESHOLD, UNKNOWN, OccupancyGrid
from tests.mapping.sessions import one_drive

RESOLUTION = 0.05


def growing_grid() -> GrowingGrid:
    return GrowingGrid(RESOLUTION, RenderingConfig())


def render(rays: list[Rays], poses: Pose) -> OccupancyGrid:
    return render_with(rays, poses, one_drive(len(rays)), RESOLUTION, RenderingConfig()).in_one_piece()


def corridor(free: float) -> tuple[list[Rays], Pose]:
    """300 keyframes along a corridor 3 m wide, away from the origin and back; a tenth of the beams miss, and
    clear so many metres to the sides."""
    rng = np.random.default_rng(0)
    rays, poses = [], []
    for i in range(300):
        x = 0.3 * min(i, 300 - i) - 7.0
        along = rng.uniform(-4.0, 4.0, 200)
        side = np.where(rng.random(200) < 0.5, 1.5, -1.5) + rng.normal(0.0, 0.01, 200)
        side[180:] *= free / 1.5
        rays.append(Rays.to(np.column_stack([along, side]), 180))
        poses.append([x, 0.1 * np.sin(x), 0.01 * np.cos(x)])
    return rays, np.array(poses)


RAYS, POSES = corridor(free=1.3)


def assert_same(grown: OccupancyGrid, whole: OccupancyGrid) -> None:
    rows, columns = np.nonzero(whole.cells != UNKNOWN)
    cells = np.column_stack([rows, columns])
    there = grown.cell_of(whole.center_of(cells))
    assert grown.contains(there).all()
    found = grown.cells[there[:, 0], there[:, 1]]
    assert np.mean(np.abs(found.astype(int) - whole.cells[rows, columns]) <= 1) > 0.999
    assert np.count_nonzero(grown.cells != UNKNOWN) == pytest.approx(len(rows), rel=0.001)


def share_of_walls(walls: OccupancyGrid, grid: OccupancyGrid) -> float:
    """How many of one grid's walls are walls on another."""
    there = grid.cell_of(walls.center_of(np.argwhere(walls.cells > 90)))
    return float(np.mean(grid.cells[there[:, 0], there[:, 1]] > 50))


def test_a_car_that_stands_has_free_floor_around_it() -> None:
    """One look shows no cell to be free; those that are held do, and are not counted again."""
    one, four = [RAYS[0]], ([RAYS[0]] * 4, np.repeat(POSES[:1], 4, axis=0))
    growing = growing_grid()

    def free(grid: OccupancyGrid) -> int:
        return int(np.count_nonzero((grid.cells >= 0) & (grid.cells < 100 * FREE_THRESHOLD)))

    assert free(growing.draw(one, POSES[:1])) == 0
    assert free(growing.draw(one, POSES[:1], four)) > 500
    assert free(growing.draw(one, POSES[:1])) == 0


@pytest.mark.parametrize("step", [1, 37])
def test_it_ends_in_the_grid_that_is_drawn_at_once(step: int) -> None:
    growing = growing_grid()
    for count in [*range(1, 80, step), *range(80, len(RAYS), 37), len(RAYS)]:
        grid = growing.draw(RAYS[:count], POSES[:count])
    assert_same(grid, render(RAYS, POSES))
    assert growing.redrawn == 0


def test_misses_end_at_walls_whenever_these_are_seen() -> None:
    """Those seen later cannot stop misses that have settled, so a few cells differ."""
    rays, poses = corridor(free=4.0)
    growing = growing_grid()
    for count in range(10, len(rays) + 1, 10):
        grid = growing.draw(rays[:count], poses[:count])
    whole = render(rays, poses)
    cells = np.argwhere(whole.cells > 50)
    there = grid.cell_of(whole.center_of(cells))
    assert np.mean(grid.cells[there[:, 0], there[:, 1]] > 50) > 0.99
    beyond = np.array([[x, y] for x in np.arange(0.0, 60.0, 0.5) for y in (-1.9, 1.9)])
    for each in (grid, whole):
        there = each.cell_of(beyond)
        inside = there[each.contains(there)]
        assert np.mean(each.cells[inside[:, 0], inside[:, 1]] == UNKNOWN) > 0.9


def test_latest_keyframes_are_drawn_where_they_are_now() -> None:
    growing = growing_grid()
    moved = POSES.copy()
    moved[-40:, :2] += 0.4
    growing.draw(RAYS, moved)
    assert_same(growing.draw(RAYS, POSES), render(RAYS, POSES))
    assert growing.redrawn == 0


def test_all_is_redrawn_when_a_loop_moves_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_grid_module, "_REDRAWN_AT_ONCE", len(RAYS))
    growing = growing_grid()
    bent = POSES.copy()
    bent[:, 1] += np.linspace(0.0, 2.0, len(bent))
    growing.draw(RAYS, bent)
    assert_same(growing.draw(RAYS, POSES), render(RAYS, POSES))
    assert growing.redrawn == 1


def test_a_large_grid_is_redrawn_over_several_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_grid_module, "_REDRAWN_AT_ONCE", 100)
    growing, bent = growing_grid(), POSES.copy()
    bent[:, 1] += np.linspace(0.0, 2.0, len(bent))
    before = growing.draw(RAYS[:290], bent[:290])
    meanwhile = [growing.draw(RAYS[:count], POSES[:count]) for count in (290, 295)]
    after = growing.draw(RAYS, POSES)
    bent_walls = render(RAYS[:200], bent[:200])
    shown = [share_of_walls(bent_walls, grid) for grid in (before, *meanwhile)]
    assert min(shown) > 0.7
    assert share_of_walls(bent_walls, after) < 0.3
    assert_same(after, render(RAYS, POSES))
    assert growing.redrawn == 1


def test_what_creeps_is_redrawn_in_the_end() -> None:
    growing = growing_grid()
    for share in np.linspace(1.0, 0.0, 21):
        grid = growing.draw(RAYS, POSES + share * np.array([0.0, 0.2, 0.0]))
    assert growing.redrawn >= 4
    assert share_of_walls(render(RAYS, POSES), grid) > 0.6


def test_keyframes_that_were_trimmed_are_not_redrawn() -> None:
    growing, bent = growing_grid(), POSES + np.array([0.0, 0.5, 0.0])
    growing.draw(RAYS, bent)
    left = [Rays.none() if 50 <= k < 120 else each for k, each in enumerate(RAYS)]
    seen = [k for k, each in enumerate(left) if each.are_kept]
    grid = growing.draw(left, POSES)
    assert_same(grid, render([RAYS[k] for k in seen], POSES[seen]))


def test_a_grid_that_was_handed_out_stays_as_it_was() -> None:
    growing = growing_grid()
    first = growing.draw(RAYS[:100], POSES[:100])
    before = first.cells.copy()
    growing.draw(RAYS, POSES)
    assert np.array_equal(first.cells, before)
