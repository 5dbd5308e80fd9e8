import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid


def test_a_grid_comes_back_from_its_message() -> None:
    from racecar.pipelines.live.ros.messages import grid_message, grid_of, time_message

    cells = np.random.default_rng(0).integers(-1, 101, size=(4, 7)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.1, np.array([1.0, -2.0, 3.0]))
    back = grid_of(grid_message(time_message(0), "map", grid))
    assert np.array_equal(back.cells, cells)
    assert back.resolution == pytest.approx(0.1)
    np.testing.assert_allclose(back.map_from_grid, grid.map_from_grid)


@pytest.mark.parametrize("fault", ["size", "resolution", "origin", "value"])
def test_a_grid_that_makes_no_map_is_refused(fault: str) -> None:
    from racecar.pipelines.live.ros.messages import grid_message, grid_of, time_message

    message = grid_message(time_message(0), "map", OccupancyGrid(np.zeros((4, 7), np.int8), 0.1, np.zeros(3)))
    if fault == "size":
        message.info.width = 8
    elif fault == "resolution":
        message.info.resolution = 0.0
    elif fault == "origin":
        message.info.origin.position.x = float("nan")
    else:
        message.data[3] = 101
    with pytest.raises(UserError, match="do not make a map"):
        grid_of(message)


def test_an_initial_pose_without_covariance_is_spread_by_the_settings() -> None:
    from racecar.pipelines.live.ros.messages import pose_message, start_pose, time_message

    covariance = np.diag([0.25, 0.2, 0.07])
    pose, told = start_pose(pose_message(time_message(0), "map", np.array([1.0, 2.0, -3.0]), covariance))
    np.testing.assert_allclose(pose, [1.0, 2.0, -3.0])
    np.testing.assert_allclose(told, covariance)
    _, told = start_pose(pose_message(time_message(0), "map", pose, np.zeros((3, 3))))
    assert told is None


def test_an_initial_pose_without_a_direction_is_refused() -> None:
    from racecar.pipelines.live.ros.messages import pose_message, start_pose, time_message

    message = pose_message(time_message(0), "map", np.zeros(3), np.eye(3))
    message.pose.pose.orientation.w = 0.0
    with pytest.raises(UserError, match="not valid"):
        start_pose(message)
