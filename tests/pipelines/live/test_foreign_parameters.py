"""Parameter files of AMCL and slam_toolbox are taken, as far as there are counterparts."""

from pathlib import Path
from typing import Any

import pytest

from tests.pipelines.live.live_car import recorded
from tests.pipelines.live.stage import Stage, car_stage

AMCL_FILE = Path(__file__).parent / "amcl_params.yaml"
SLAM_TOOLBOX_FILE = Path(__file__).parent / "slam_toolbox_params.yaml"
AS_AMCL = ("-r", "__node:=amcl", "--params-file", str(AMCL_FILE))
AS_SLAM_TOOLBOX = ("-r", "__node:=slam_toolbox", "--params-file", str(SLAM_TOOLBOX_FILE))


def told(stage: Stage) -> str:
    (line,) = [line for line in stage.bus.log if "Parameters of" in line]
    return line


def value(stage: Stage, name: str) -> Any:
    return stage.live.node.get_parameter(name).value


def test_a_localizer_called_amcl_takes_what_amcl_was_given(tmp_path: Path) -> None:
    with car_stage() as stage:
        stage.localize(tmp_path, AS_AMCL, initial_pose=recorded()[0][2])
        stage.car.drive()
        stage.await_right(4.0)
        taken = {name: value(stage, name) for name in ("particles", "fewest_particles", "beams", "max_range")}
        assert taken == {"particles": 2000, "fewest_particles": 500, "beams": 60, "max_range": None}
        assert value(stage, "transform_tolerance") == 1.0
        line = told(stage)
        assert "max_particles as particles" in line
        assert "initial_pose.yaw" in line.partition("Without a counterpart")[0]
        assert "odom_frame_id (the messages of the odometry name its frame)" in line
        assert line.endswith("Unknown here and in AMCL: max_speed_of_light.")
        assert "controller_frequency" not in line


def test_a_localizer_called_amcl_starts_where_the_file_says(tmp_path: Path) -> None:
    x, y, yaw = recorded()[0][2]
    place = ("-p", f"initial_pose.x:={x}", "-p", f"initial_pose.y:={y}", "-p", f"initial_pose.yaw:={yaw}")
    with car_stage() as stage:
        stage.localize(tmp_path, ("-p", "set_initial_pose:=true", *place))
        stage.car.drive()
        stage.await_right()
        assert "Global localization" not in stage.bus.said
        assert "Parameters of" not in stage.bus.said


def test_a_mapper_called_slam_toolbox_takes_what_that_was_given(tmp_path: Path) -> None:
    from nav_msgs.msg import OccupancyGrid

    from racecar.pipelines.live.ros.qos import LATCHED

    with car_stage() as stage:
        stage.map(tmp_path / "out", *AS_SLAM_TOOLBOX)
        maps = stage.hear("/map", OccupancyGrid, LATCHED)
        stage.car.drive()
        stage.await_right(6.0)
        taken = {name: value(stage, name) for name in ("keyframe_distance", "close_loops", "max_range")}
        assert taken == {"keyframe_distance": 0.5, "close_loops": True, "max_range": None}
        assert maps[-1].info.resolution == pytest.approx(0.1)
        line = told(stage)
        assert "minimum_travel_distance as keyframe_distance" in line
        assert "solver_plugin, ceres_linear_solver, ceres_loss_function (GTSAM solves the pose graph)" in line
        assert "Unknown" not in line


def test_a_mapper_starts_where_slam_toolboxs_map_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "lab.posegraph").touch()
    with car_stage() as stage:
        stage.map(
            tmp_path / "out", "-p", f"map_file_name:={tmp_path / 'lab'}", "-p", "map_start_at_dock:=true"
        )
        assert stage.warnings("This drive has a map of its own") == 1
        assert stage.warnings("lab is a pose graph of slam_toolbox, which only that can read") == 1


def test_the_section_of_another_node_is_not_taken(tmp_path: Path) -> None:
    with car_stage() as stage:
        stage.localize(tmp_path, ("--params-file", str(AMCL_FILE)))
        assert value(stage, "particles") == 4000
        assert "Parameters of" not in stage.bus.said


def test_a_file_for_a_node_of_another_name_comes_with_a_remedy() -> None:
    from racecar.pipelines.live.ros.foreign_parameters import AMCL, SLAM_TOOLBOX

    sentence = AMCL.unread_section("racecar_localizer", AS_AMCL)
    assert sentence is not None
    assert sentence.endswith("is not read, as this node is called racecar_localizer; add -r __node:=amcl.")
    assert AMCL.unread_section("amcl", AS_AMCL) is None
    assert SLAM_TOOLBOX.unread_section("racecar_mapper", AS_AMCL) is None
    assert AMCL.unread_section("racecar_localizer", ("--params-file", "nowhere.yaml")) is None


def test_own_parameters_overrule_those_of_amcl(tmp_path: Path) -> None:
    with car_stage() as stage:
        stage.localize(tmp_path, (*AS_AMCL, "-p", "particles:=3000"))
        assert value(stage, "particles") == 3000
        assert "Overruled by those of this node: max_particles (by particles)." in told(stage)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ("min_particles:=few", "fewest_particles has a bad value: it should be an integer, not 'few'"),
        ("tf_broadcast:=maybe", "tf has a bad value: it should be 'odom', 'base' or 'none', not 'maybe'"),
        ("max_beams:=0", "beams has a bad value: it should be greater than or equal to 1, not 0"),
        ("max_particles:=true", "particles has a bad value: it should not be true or false"),
    ],
)
def test_a_value_that_does_not_fit_is_named_and_the_node_starts(
    tmp_path: Path, given: str, complaint: str
) -> None:
    with car_stage() as stage:
        stage.localize(tmp_path, ("-p", given))
        name, ours = given.partition(":=")[0], complaint.split()[0]
        assert stage.warnings(f"{name} of AMCL is left out. The parameter {complaint}.") == 1
        assert f"{name} as {ours}" not in stage.bus.said
        assert (
            value(stage, ours)
            == {"fewest_particles": 1000, "tf": "odom", "beams": 100, "particles": 4000}[ours]
        )


def test_amcl_without_its_transform_publishes_none(tmp_path: Path) -> None:
    with car_stage() as stage:
        stage.localize(tmp_path, ("-p", "tf_broadcast:=false"))
        assert value(stage, "tf") == "none"
