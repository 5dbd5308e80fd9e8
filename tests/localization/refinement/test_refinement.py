import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.refinement import refine
from racecar.localization.refinement.wall_surface import PRIOR, WallSurface
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from tests.localization.scenes import SIGHT, points_at, ranges_from, seen_in_corridor, slanted_corridor
from tests.sensors.drives import BEARINGS, room

CLOUD = np.diag([0.01, 0.01, 0.0025])


@pytest.mark.parametrize("seed", range(5))
def test_people_do_not_draw_the_estimate_aside(seed: int) -> None:
    grid, rng = room(), np.random.default_rng(seed)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    ranges = ranges_from(grid, truth)
    ranges[100:160] *= rng.uniform(0.6, 0.95, 60)
    points = points_at(ranges)
    start = compose(truth, [0.15, -0.1, 0.04])
    refined, covariance = refine(start, CLOUD, points, Walls(grid), 0.25 * grid.resolution)
    assert np.sqrt(np.trace(covariance[:2, :2])) < 0.05
    assert np.hypot(*(refined - truth)[:2]) < 0.03
    assert abs(refined[2] - truth[2]) < 0.01


def test_along_a_bare_corridor_the_estimate_stays() -> None:
    cells = np.full((60, 2000), FREE, dtype=np.int8)
    cells[:10], cells[50:] = OCCUPIED, OCCUPIED
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    truth = np.array([50.0, 1.5, 0.0])
    ranges = ranges_from(grid, truth, IDENTITY)
    points = points_at(np.where(ranges < 10.0, ranges, np.inf), IDENTITY)
    start = np.add(truth, [0.1, 0.1, 0.02])
    refined, covariance = refine(start, CLOUD, points, Walls(grid), 0.25 * grid.resolution)
    assert abs(refined[0] - truth[0] - 0.1) < 0.02
    assert abs(refined[1] - truth[1]) < 0.02
    assert abs(refined[2]) < 0.005
    along, across = np.sqrt(np.diag(covariance)[:2])
    assert along > 0.09
    assert across < 0.03


def test_too_few_points_change_nothing() -> None:
    start = np.array([1.0, 2.0, 0.3])
    points = points_at(np.where(np.arange(len(BEARINGS)) < 5, 1.0, np.inf))
    refined, covariance = refine(start, CLOUD, points, Walls(room()), 0.0125)
    np.testing.assert_array_equal(refined, start)
    np.testing.assert_array_equal(covariance, CLOUD)


def along_over_cloud(degrees: float, resolution: float, thickness: float, *, with_doors: bool) -> float:
    """The mean of some positions: the deviation along a corridor as a share of the cloud's, of 0.25 m."""
    rng = np.random.default_rng(0)
    grid = slanted_corridor(degrees, resolution, thickness=thickness, with_doors=with_doors)
    walls, yaw = Walls(grid), np.radians(degrees)
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    turned = np.column_stack([ahead, [-ahead[1], ahead[0]]])
    cloud = np.diag([0.0, 0.0, 0.01**2])
    cloud[:2, :2] = turned @ np.diag([0.25**2, 0.02**2]) @ turned.T
    shares = []
    for _ in range(5):
        pose, points = seen_in_corridor(degrees, rng.uniform(-0.5, 0.5), rng.normal(0.0, 0.1), rng)
        if with_doors:
            ranges = ranges_from(grid, pose, IDENTITY)
            points = points_at(np.where(ranges < SIGHT, ranges, np.inf), IDENTITY).thinned(100)
        _, covariance = refine(pose, cloud, points, walls, 0.25 * walls.grid.resolution)
        shares.append(np.sqrt(ahead @ covariance[:2, :2] @ ahead) / 0.25)
    return float(np.mean(shares))


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 45.0), st.sampled_from([0.02, 0.05, 0.1]), st.sampled_from([0.0, 0.2, 0.3]))
def test_the_steps_of_a_slanted_wall_do_not_tell_where_along_it(
    degrees: float, resolution: float, thickness: float
) -> None:
    """Of walls as thin as those that a mapper draws, and as thick as those of houses."""
    share = along_over_cloud(degrees, resolution, max(thickness, 1.5 * resolution), with_doors=False)
    assert 1.0 / 1.5 < share < 1.5


@settings(max_examples=5, deadline=None)
@given(st.floats(0.0, 45.0), st.sampled_from([0.02, 0.05, 0.1]))
def test_corners_tell(degrees: float, resolution: float) -> None:
    assert along_over_cloud(degrees, resolution, 0.2, with_doors=True) < 0.4


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
