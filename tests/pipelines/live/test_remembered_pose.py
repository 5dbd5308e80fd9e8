import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.remembered_pose import PoseMemory, RememberedPose

GRID = OccupancyGrid(np.zeros((5, 5), np.int8), 0.1, np.zeros(3))
SECOND = 1_000_000_000


def pose(**fields: Any) -> RememberedPose:
    usual = {"map_from_base": [1.0, 2.0, 0.5], "covariance": np.diag([0.01, 0.02, 0.003])}
    odometry = {"odometry_stamp": 100 * SECOND, "odom_from_base": [7.0, 8.0, -0.2]}
    return RememberedPose.model_validate({**usual, **odometry, **fields})


def remembered(tmp_path: Path) -> RememberedPose:
    memory = PoseMemory(tmp_path, GRID)
    memory.save(pose())
    return loaded(memory)


def loaded(memory: PoseMemory) -> RememberedPose:
    found = memory.load()
    assert found is not None
    return found


def test_a_pose_is_remembered_for_its_map_only(tmp_path: Path) -> None:
    np.testing.assert_allclose(remembered(tmp_path).map_from_base, [1.0, 2.0, 0.5])
    assert PoseMemory(tmp_path, replace(GRID, resolution=0.2)).load() is None


def test_what_was_saved_last_comes_back_to_the_bit(tmp_path: Path) -> None:
    memory = PoseMemory(tmp_path, GRID)
    place, covariance = np.array([1.25, -3.5, 0.1 + 0.2]), np.diag([0.01, 0.02, 1e-5])
    for share in (0.0, 1.0):  # the second replaces the first
        known = {"map_from_base": share * place, "odom_from_base": share * place, "covariance": covariance}
        memory.save(pose(odometry_stamp=10**18 + 1, **known))
    found = loaded(memory)
    assert found.odom_from_base is not None
    assert found.map_from_base.tobytes() == place.tobytes()
    assert found.covariance.tobytes() == covariance.tobytes()
    assert (found.odometry_stamp, found.odom_from_base.tobytes()) == (10**18 + 1, place.tobytes())
    assert [path.name for path in tmp_path.iterdir()] == [memory.path.name]


@pytest.mark.parametrize(
    "more",
    [
        *(f'"odometry_stamp": 5, "odom_from_base": {each}' for each in ('"x"', "[1, 2]", "[1, 2, null]")),
        '"odometry_stamp": 5, "odom_from_base": [1, 2, NaN]',
        *(f'"laser": {each}' for each in ("3", '{"base_frame": "b"}')),
        '"laser": {"base_frame": 1, "base_from_laser": [1]}',
    ],
)
def test_damaged_odometry_and_a_damaged_place_of_the_laser_are_not_remembered(
    tmp_path: Path, more: str
) -> None:
    memory = PoseMemory(tmp_path, GRID)
    pose = '"map_from_base": [1, 2, 3], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]'
    memory.path.write_text(f"{{{pose}, {more}}}")
    found = loaded(memory)
    assert (found.odometry_stamp, found.laser) == (None, None)


def test_where_the_laser_sits_is_remembered(tmp_path: Path) -> None:
    assert remembered(tmp_path).laser is None
    memory = PoseMemory(tmp_path, GRID)
    place = np.eye(4) + 0.1
    memory.save(pose(laser=LaserPlace("base_link", "laser", place)))
    found = loaded(memory)
    assert found.laser is not None
    assert (found.laser.base_frame, found.laser.laser_frame) == ("base_link", "laser")
    np.testing.assert_array_equal(found.laser.base_from_laser, place)


def test_odometry_that_went_on_tells_how_far_the_car_drove_meanwhile(tmp_path: Path) -> None:
    found = remembered(tmp_path)
    step = np.array([3.0, 0.5, 1.0])
    carried = found.carried_to(103 * SECOND, compose(found.odom_from_base, step))
    assert carried is not None
    pose, covariance = carried
    np.testing.assert_allclose(pose, compose([1.0, 2.0, 0.5], step))
    assert covariance[0, 0] > 0.01


@pytest.mark.parametrize(("stamp", "far"), [(99, 0.1), (101, 50.0), (100_000, 0.1)])
def test_odometry_that_began_anew_tells_nothing(tmp_path: Path, stamp: int, far: float) -> None:
    found = remembered(tmp_path)
    assert found.carried_to(stamp * SECOND, compose(found.odom_from_base, [far, 0.0, 0.0])) is None


@pytest.mark.parametrize("since", [[0.0, 0.0, 0.0], [0.2, -0.2, 0.1], [3.0, 0.4, 0.2]])
def test_odometry_that_counts_anew_tells_how_far_the_car_drove_since(
    tmp_path: Path, since: list[float]
) -> None:
    """After a reboot it is where it began, or a little further, as if the car had driven all the way back."""
    PoseMemory(tmp_path, GRID).save(pose(odom_from_base=[27.4, 0.3, 0.1]))
    found = loaded(PoseMemory(tmp_path, GRID))
    carried = found.carried_to(220 * SECOND, np.array(since))
    assert carried is not None
    np.testing.assert_allclose(carried[0], compose(found.map_from_base, since))
    assert np.sqrt(carried[1][0, 0]) > 0.3
    left, covariance = found.left_there
    np.testing.assert_array_equal(left, found.map_from_base)
    assert np.sqrt(covariance[0, 0]) > 0.3


def test_odometry_that_still_is_at_its_begin_went_on(tmp_path: Path) -> None:
    memory = PoseMemory(tmp_path, GRID)
    memory.save(pose(odom_from_base=[0.1, 0.0, 0.0]))
    found = loaded(memory)
    assert found.carried_to(110 * SECOND, np.zeros(3)) is not None


def test_no_odometry_is_older_than_the_computer_is_on(tmp_path: Path) -> None:
    path = PoseMemory(tmp_path, GRID).path
    assert remembered(tmp_path).odometry_stamp is not None
    os.utime(path, (1e9, 1e9))
    found = loaded(PoseMemory(tmp_path, GRID))
    assert found.odometry_stamp is None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[1",
        "[]",
        "7",
        "{}",
        '{"map_from_base": "x"}',
        '{"map_from_base": [1, 2], "covariance": [[1]]}',
        '{"map_from_base": [1, 2, 3], "covariance": [[1]]}',
        '{"map_from_base": [1, 2, null], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}',
        '{"map_from_base": [1, 2, 3], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, NaN]]}',
        '{"map_from_base": [1, 2, 3], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}',
    ],
)
def test_a_damaged_memory_is_an_error_that_names_the_file(tmp_path: Path, text: str) -> None:
    memory = PoseMemory(tmp_path, GRID)
    memory.path.write_text(text)
    with pytest.raises(UserError, match=memory.path.name):
        memory.load()


def test_a_memory_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    memory = PoseMemory(tmp_path, GRID)
    memory.path.write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(UserError, match="not a text file"):
        memory.load()
