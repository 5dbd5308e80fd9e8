import numpy as np
import pytest

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.wall_surface import PRIOR, WallSurface
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from tests.localization.scans import points_at, ranges_from
from tests.sensors.drives import room


def learned(grid: OccupancyGrid, farther: float, noise: float, seed: int = 0) -> float:
    """Cells before the centre after 100 scans whose walls lie so many metres behind the edges of cells."""
    rng, surface = np.random.default_rng(seed), WallSurface(Walls(grid))
    for _ in range(100):
        pose: Pose = compose(
            grid.map_from_grid, [*rng.uniform([7.0, 3.0], [11.0, 5.0]), rng.uniform(-3.1, 3.1)]
        )
        ranges = ranges_from(grid, pose)
        ranges += farther + noise * rng.standard_normal(len(ranges))
        surface.learn(pose, points_at(ranges))
    return surface.metres / grid.resolution


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.03])
def test_walls_that_end_where_cells_do_lie_half_a_cell_before_their_centres(noise: float) -> None:
    assert learned(room(), 0.0, noise) == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.03])
def test_walls_at_the_centres_of_thin_lines_are_found_there(noise: float) -> None:
    cells = np.full((160, 360), FREE, dtype=np.int8)
    cells[9], cells[-9], cells[:, 9], cells[:, -9] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    assert learned(OccupancyGrid(cells, 0.05, IDENTITY), 0.035, noise) == pytest.approx(0.0, abs=0.15)


def test_nothing_is_learned_of_points_far_from_walls() -> None:
    surface = WallSurface(Walls(room()))
    pose = compose(room().map_from_grid, [9.0, 4.0, 0.0])
    surface.learn(pose, EndPoints(np.array([[1.0, 0.0], [0.0, 1.0]]), np.zeros(2)))
    assert surface.metres == PRIOR * room().resolution
