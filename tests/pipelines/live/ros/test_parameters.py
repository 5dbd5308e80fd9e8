"""Settings as parameters of a node."""

import re
from collections.abc import Iterator
from typing import Any

import pytest

from racecar.maps.errors import UserError
from tests.maps.nested_settings import Camera, Lens, Robot


@pytest.fixture
def node(request: pytest.FixtureRequest) -> Iterator[Any]:
    """With the parameters that a test gives as ROS arguments."""
    from racecar.pipelines.live.ros.run import ros_node

    given = [word for each in getattr(request, "param", ()) for word in ("-p", each)]
    with ros_node("test_parameters", ["--ros-args", *given] if given else []) as node:
        yield node


def test_settings_are_declared_with_meaning_and_bounds(node: Any) -> None:
    from racecar.pipelines.live.ros.parameters import declare_settings

    assert declare_settings(node, Robot()) == Robot()
    focus = node.describe_parameter("camera.lens.focus")
    assert focus.description == "metres to the focus"
    assert focus.additional_constraints == "greater than 0, at most 2"
    assert (focus.floating_point_range[0].from_value, focus.floating_point_range[0].to_value) == (0.0, 2.0)
    exposures = node.describe_parameter("camera.exposures")
    assert (exposures.integer_range[0].from_value, exposures.integer_range[0].to_value) == (1, 9)
    speed = node.describe_parameter("speed")
    assert speed.additional_constraints == "at least 0"
    assert not speed.floating_point_range
    assert node.describe_parameter("is_tall").additional_constraints == ""


@pytest.mark.parametrize(
    "node",
    [["camera.lens.focus:=1.5", "camera.lens.rings:=[5, 6]", "is_tall:=true"]],
    indirect=True,
)
def test_what_ros_overrides_comes_back_in_the_settings(node: Any) -> None:
    from racecar.pipelines.live.ros.parameters import declare_settings

    settings = declare_settings(node, Robot(speed=3.0))
    assert settings == Robot(speed=3.0, is_tall=True, camera=Camera(lens=Lens(focus=1.5, rings=(5, 6))))


@pytest.mark.parametrize(
    ("node", "complaint"),
    [
        (["camera.lens.focus:=3.0"], "camera.lens.focus must be greater than 0, at most 2"),
        (
            ["camera.lens.focus:=0.0"],
            "focus has a bad value: it should be greater than 0, not 0.0",
        ),
        (["camera.exposures:=0"], "camera.exposures must be at least 1, at most 9"),
        (["camera.exposures:=many"], "camera.exposures has a bad value: it should be an integer, not 'many'"),
        (["speed:=-1.0"], "speed has a bad value: it should be greater than or equal to 0"),
        (["camera.mode:=dusk"], "camera.mode has a bad value: it should be 'day' or 'night'"),
    ],
    indirect=["node"],
)
def test_a_parameter_at_fault_is_named(node: Any, complaint: str) -> None:
    from racecar.pipelines.live.ros.parameters import declare_settings

    with pytest.raises(UserError, match=complaint):
        declare_settings(node, Robot())


@pytest.mark.parametrize(
    ("node", "complaint"),
    [
        (["transform_tolerance:=20.0"], "transform_tolerance must be at least 0, at most 10"),
        (["laser_pose:=[1.0, 2.0]"], "give x and y in metres and yaw in radians"),
        (["laser_pose:=[0.2, 0.0, 90.0]"], "1.5708 if these are degrees"),
        (["tf:=odometry"], "tf has a bad value: it should be 'odom', 'base' or 'none'"),
        (["odometry:=speed"], "odometry has a bad value: it should be 'pose' or 'twist'"),
    ],
    indirect=["node"],
)
def test_what_is_said_of_the_car_and_cannot_be_is_named(node: Any, complaint: str) -> None:
    from racecar.pipelines.live.ros.parameters import CarParameters, declare_settings

    with pytest.raises(UserError, match=re.escape(complaint)):
        declare_settings(node, CarParameters(), read_only=True)


def test_nested_settings_change_while_running(node: Any) -> None:
    from rclpy.parameter import Parameter

    from racecar.pipelines.live.ros.parameters import declare_settings, watch_settings

    applied = [declare_settings(node, Robot())]
    watch_settings(node, lambda: applied[-1], applied.append)

    def change(**changes: Any) -> Any:
        return node.set_parameters_atomically(
            [Parameter(name.replace("__", "."), value=value) for name, value in changes.items()]
        )

    assert change(camera__lens__focus=0.75, camera__mode="night").successful
    assert applied[-1] == Robot(camera=Camera(mode="night", lens=Lens(focus=0.75)))
    assert change(camera__lens__rings=[7]).successful
    assert applied[-1].camera.lens == Lens(focus=0.75, rings=(7,))
    refused = change(speed=2.0, camera__mode="dusk")
    assert not refused.successful
    assert "camera.mode" in refused.reason
    assert not change(camera__exposures=99).successful
    assert len(applied) == 3
    assert node.get_parameter("speed").value == 1.0
