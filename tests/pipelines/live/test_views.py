"""What RViz and Foxglove are set up to show is what the nodes publish, and what they send is heard."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

import racecar.pipelines.live
from tests.pipelines.simulation.test_driven_simulation import GRID

SHARE = Path(racecar.pipelines.live.__file__).parent / "share"
RVIZ_SHOWS = {
    "rviz_default_plugins/Map": "OccupancyGrid",
    "rviz_default_plugins/MarkerArray": "MarkerArray",
    "rviz_default_plugins/Odometry": "Odometry",
    "rviz_default_plugins/Path": "Path",
    "rviz_default_plugins/PointCloud2": "PointCloud2",
    "rviz_default_plugins/Pose": "PoseStamped",
    "rviz_default_plugins/PoseArray": "PoseArray",
}
RVIZ_SENDS = {
    "rviz_default_plugins/PublishPoint": "PointStamped",
    "rviz_default_plugins/SetGoal": "PoseStamped",
    "rviz_default_plugins/SetInitialPose": "PoseWithCovarianceStamped",
}
FOXGLOVE_DRAWS = {
    "MarkerArray",
    "OccupancyGrid",
    "Path",
    "PointCloud2",
    "PoseArray",
    "PoseStamped",
    "PoseWithCovarianceStamped",
}
HEARD_BY_THE_SIMULATED_CAR = {"/goal_pose": "PoseStamped"}
both = pytest.mark.parametrize("name", ["localize", "map"])


class Interface:
    """A node's topics: the types of the messages, and which of them wait for whoever comes late."""

    def __init__(self, node: Any, map_frame: str) -> None:
        from rclpy.qos import DurabilityPolicy

        self.map_frame = map_frame
        self.published = {topic.topic_name: topic.msg_type for topic in node.publishers}
        self.heard = {topic.topic_name: topic.msg_type.__name__ for topic in node.subscriptions}
        self.latched = {
            topic.topic_name
            for topic in node.publishers
            if topic.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        }

    def type_of(self, topic: str) -> str:
        return str(self.published[topic].__name__)


@contextmanager
def running(name: str) -> Iterator[Interface]:
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_views", []) as ros:
        live = _localizer(ros) if name == "localize" else _mapper(ros)
        live.start()
        try:
            yield Interface(ros, live.parameters.map_frame)
        finally:
            live.stop()


def _localizer(ros: Any) -> Any:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart

    return LocalizerNode(ros, Config(), LocalizerStart(GRID))


def _mapper(ros: Any) -> Any:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.live.mapper_node import MapperNode
    from racecar.pipelines.live.saving.drive_log import DriveLog
    from racecar.pipelines.live.saving.map_saving import MapOutput

    return MapperNode(ros, MapOutput(Path("nowhere"), Config(), {}), DriveLog(Path("nowhere")))


@both
def test_rviz_shows_what_the_node_publishes(name: str) -> None:
    view = _rviz(name)
    with running(name) as node:
        assert view["Global Options"]["Fixed Frame"] == node.map_frame
        shown = {each["Topic"]["Value"]: each for each in view["Displays"] if "Topic" in each}
        assert {"/map", "/path"} < set(shown)
        for topic, display in shown.items():
            assert RVIZ_SHOWS[display["Class"]] == node.type_of(topic)
            is_latched = display["Topic"]["Durability Policy"] == "Transient Local"
            assert is_latched == (topic in node.latched)


@both
def test_what_rviz_sends_is_heard(name: str) -> None:
    tools = {each["Class"]: each["Topic"]["Value"] for each in _rviz(name)["Tools"] if "Topic" in each}
    with running(name) as node:
        heard = {**node.heard, **HEARD_BY_THE_SIMULATED_CAR}
        for tool, topic in tools.items():
            assert RVIZ_SENDS[tool] == heard[topic]
    assert tools["rviz_default_plugins/SetGoal"] == "/goal_pose"


@both
def test_foxglove_draws_what_the_node_publishes(name: str) -> None:
    scene = _foxglove(name)["configById"]["3D!scene"]
    with running(name) as node:
        assert scene["followTf"] == node.map_frame
        assert {"/map", "/path"} < set(scene["topics"])
        assert {node.type_of(topic) for topic in scene["topics"]} <= FOXGLOVE_DRAWS
        if name == "localize":
            assert node.heard[scene["publish"]["poseEstimateTopic"]] == "PoseWithCovarianceStamped"
            assert node.heard[scene["publish"]["pointTopic"]] == "PointStamped"
    assert scene["publish"]["poseTopic"] in HEARD_BY_THE_SIMULATED_CAR


@both
def test_foxglove_plots_and_lists_what_the_node_publishes(name: str) -> None:
    panels = _foxglove(name)["configById"]
    paths = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    with running(name) as node:
        for path in paths:
            topic, field = re.fullmatch(r"(/\w+)\.(.*)\.@sqrt", path).groups()  # type: ignore[union-attr]
            assert isinstance(_field(node.published[topic](), field), float)
        kind = {"localize": "localizer", "map": "mapper"}[name]
        status = panels[f"DiagnosticStatusPanel!{kind}"]
        assert node.type_of(status["topicToRender"]) == "DiagnosticArray"
        assert status["selectedName"] == f"racecar: {kind}"
    assert bool(paths) == (name == "localize")


@both
def test_each_panel_of_foxglove_has_its_place(name: str) -> None:
    layout = _foxglove(name)
    assert sorted(_leaves(layout["layout"])) == sorted(layout["configById"])


def _rviz(name: str) -> Any:
    return yaml.safe_load((SHARE / f"{name}.rviz").read_text())["Visualization Manager"]


def _foxglove(name: str) -> Any:
    return json.loads((SHARE / f"{name}.foxglove.json").read_text())


def _field(message: Any, path: str) -> Any:
    """What `pose.covariance[7]` leads to."""
    for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", path):
        message = getattr(message, name)
        if index:
            message = message[int(index)]
    return message


def _leaves(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else _leaves(tree["first"]) + _leaves(tree["second"])
