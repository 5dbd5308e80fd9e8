"""The files to start nodes with, and to look at them with RViz and Foxglove, fit the nodes."""

import json
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import racecar.pipelines.live
from racecar.maps.grid.edits import Edit
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import app
from racecar.pipelines.files.filter_masks import FILTERS, save_filter_masks
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from tests.pipelines.live.stage import localizer, mapper
from tests.pipelines.simulation.test_driven_simulation import GRID

SHARE = Path(racecar.pipelines.live.__file__).parent / "share"
RVIZ_SHOWS = {
    "Map": "OccupancyGrid",
    "MarkerArray": "MarkerArray",
    "Odometry": "Odometry",
    "Path": "Path",
    "PointCloud2": "PointCloud2",
    "Pose": "PoseStamped",
    "PoseArray": "PoseArray",
}
RVIZ_SENDS = {
    "PublishPoint": "PointStamped",
    "SetGoal": "PoseStamped",
    "SetInitialPose": "PoseWithCovarianceStamped",
}
FOXGLOVE_DRAWS = {*RVIZ_SHOWS.values(), "PoseWithCovarianceStamped"} - {"Odometry"}
HEARD_BY_THE_SIMULATED_CAR = {"/goal_pose": "PoseStamped"}
NODES = {"localize": "localizer", "map": "mapper", "simulate": "simulator"}
"""By their commands."""
looked_at = pytest.mark.parametrize("started", ["localize", "map"], indirect=True)


@dataclass
class Started:
    """A node with the parameters of its file, its topics, and which of them wait for who comes late."""

    name: str
    parameters: dict[str, Any]
    published: dict[str, Any]
    heard: dict[str, str]
    latched: set[str]

    def type_of(self, topic: str) -> str:
        return str(self.published[topic].__name__)

    @property
    def rviz(self) -> Any:
        return yaml.safe_load((SHARE / f"{self.name}.rviz").read_text())["Visualization Manager"]

    @property
    def foxglove(self) -> Any:
        return json.loads((SHARE / f"{self.name}.foxglove.json").read_text())


@pytest.fixture(scope="module")
def started(request: pytest.FixtureRequest) -> Iterator[Started]:
    from racecar.pipelines.live.simulator_node import SimulatorNode
    from tests.pipelines.live.bus import ros_bus

    name: str = request.param
    with ros_bus() as bus:
        node = bus.node("test_share", "--params-file", str(SHARE / f"{NODES[name]}.yaml"))
        if name == "localize":
            live: Any = localizer(node, grid=GRID)
        elif name == "map":
            live = mapper(node, Path("nowhere"))
        else:
            live = SimulatorNode(node, DrivenSimulation(GRID, Conditions()), pace=1.0, teleports=False)
        live.start()
        yield Started(
            name,
            {name: parameter.value for name, parameter in node._parameters.items()},
            {topic.topic_name: topic.msg_type for topic in bus.publishers},
            {topic.topic_name: topic.msg_type.__name__ for topic in bus.subscriptions},
            {topic.topic_name for topic in bus.publishers if topic.is_latched},
        )


def test_the_command_names_the_folder() -> None:
    result = CliRunner().invoke(app, ["live", "files"])
    assert Path(result.output.strip()) == SHARE


@pytest.mark.parametrize("name", NODES)
def test_a_launch_file_starts_a_command_that_there_is(name: str) -> None:
    command = _commands(name)[0]
    assert command.startswith(f"racecar live {name} ")
    own, _, ros = command.partition("--ros-args")
    flags = {word for word in own.split() if word.startswith("--")}
    shown = CliRunner().invoke(app, ["live", name, "--help"], env={"COLUMNS": "200"}).output
    assert all(flag in shown for flag in flags)
    managed = "" if name == "simulate" else "-p use_lifecycle_manager:=$(var use_lifecycle_manager) "
    assert f"--params-file $(var params) {managed}{_remapped(name)}".rstrip() == ros.strip()


@pytest.mark.parametrize("name", NODES)
def test_a_launch_file_uses_its_arguments_and_names_files_that_there_are(name: str) -> None:
    root = ElementTree.parse(SHARE / f"{name}.launch.xml").getroot()
    texts = [value for each in root.iter() for value in each.attrib.values()]
    used = {variable for text in texts for variable in re.findall(r"\$\(var (\w+)\)", text)}
    assert used == {argument.get("name") for argument in root.findall("arg")}
    named = [file for text in texts for file in re.findall(r"\$\(dirname\)/(\S+)", text)]
    assert [file for file in named if not (SHARE / file).is_file()] == []
    assert f"rviz2 -d $(dirname)/{name}.rviz" in _commands(name) or name == "simulate"


@pytest.mark.parametrize("kind", FILTERS)
def test_a_mask_is_served_from_the_folder_of_its_run(
    kind: Literal["keepout", "speed"], tmp_path: Path
) -> None:
    area = Edit(kind, np.array([[0.2, 0.2], [0.8, 0.2], [0.8, 0.8]]), limit=0.5)
    save_filter_masks(TiledGrid({}, 20, 20, 0.05, np.zeros(3)), [area], tmp_path)
    root = ElementTree.parse(SHARE / "costmap_filter.launch.xml").getroot()
    values = {"kind": kind, "run": str(tmp_path), "use_sim_time": "false"}

    def filled(text: str) -> str:
        return re.sub(r"\$\(var (\w+)\)", lambda match: values[match[1]], text)

    masks, told, manager = root.findall("node")
    named = {param.get("name"): filled(param.get("value", "")) for each in (masks, manager) for param in each}
    assert load_map(named["yaml_filename"]).cells.max() > 0
    served = [filled(each.get("name", "")) for each in (masks, told)]
    assert named["node_names"].split(",") == served
    for node in (masks, told):
        (file,) = (filled(param.get("from", "")) for param in node if param.get("from"))
        assert list(yaml.safe_load(Path(file).read_text())) == served


def _commands(name: str) -> list[str]:
    root = ElementTree.parse(SHARE / f"{name}.launch.xml").getroot()
    return [str(each.get("cmd")) for each in root.findall("executable")]


def _remapped(name: str) -> str:
    """The topics whose names differ from car to car; the simulated car has its own."""
    topics = () if name == "simulate" else ("scan", "odom", "imu")
    return " ".join(f"-r {topic}:=$(var {topic})" for topic in topics)


@pytest.mark.parametrize("started", NODES, indirect=True)
def test_every_parameter_that_is_explained_is_declared(started: Started) -> None:
    told = yaml.safe_load((SHARE / f"{NODES[started.name]}.yaml").read_text())["/**"]["ros__parameters"]
    for name, value in told.items():
        declared = started.parameters[name]
        assert (list(declared) if isinstance(value, list) else declared) == value


@looked_at
def test_rviz_shows_what_the_node_publishes(started: Started) -> None:
    view = started.rviz
    assert view["Global Options"]["Fixed Frame"] == started.parameters["map_frame"]
    shown = {each["Topic"]["Value"]: each for each in view["Displays"] if "Topic" in each}
    assert {"/map", "/path"} < set(shown)
    for topic, display in shown.items():
        assert RVIZ_SHOWS[display["Class"].removeprefix("rviz_default_plugins/")] == started.type_of(topic)
        is_latched = display["Topic"]["Durability Policy"] == "Transient Local"
        assert is_latched == (topic in started.latched)


@looked_at
def test_what_rviz_sends_is_heard(started: Started) -> None:
    tools = {
        each["Class"].removeprefix("rviz_default_plugins/"): each["Topic"]["Value"]
        for each in started.rviz["Tools"]
        if "Topic" in each
    }
    heard = {**started.heard, **HEARD_BY_THE_SIMULATED_CAR}
    assert {tool: heard[topic] for tool, topic in tools.items()} == {tool: RVIZ_SENDS[tool] for tool in tools}
    assert tools["SetGoal"] == "/goal_pose"


@looked_at
def test_foxglove_draws_what_the_node_publishes(started: Started) -> None:
    scene = started.foxglove["configById"]["3D!scene"]
    assert scene["followTf"] == started.parameters["map_frame"]
    assert {"/map", "/path"} < set(scene["topics"])
    assert {started.type_of(topic) for topic in scene["topics"]} <= FOXGLOVE_DRAWS
    if started.name == "localize":
        assert started.heard[scene["publish"]["poseEstimateTopic"]] == "PoseWithCovarianceStamped"
        assert started.heard[scene["publish"]["pointTopic"]] == "PointStamped"
    assert scene["publish"]["poseTopic"] in HEARD_BY_THE_SIMULATED_CAR


@looked_at
def test_foxglove_plots_and_lists_what_the_node_publishes(started: Started) -> None:
    panels = started.foxglove["configById"]
    paths = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    for path in paths:
        topic, field = re.fullmatch(r"(/\w+)\.(.*)\.@sqrt", path).groups()  # type: ignore[union-attr]
        assert isinstance(_field(started.published[topic](), field), float)
    assert bool(paths) == (started.name == "localize")
    kind = NODES[started.name]
    status = panels[f"DiagnosticStatusPanel!{kind}"]
    assert started.type_of(status["topicToRender"]) == "DiagnosticArray"
    assert status["selectedName"] == f"racecar: {kind}"


@looked_at
def test_each_panel_of_foxglove_has_its_place(started: Started) -> None:
    assert sorted(_leaves(started.foxglove["layout"])) == sorted(started.foxglove["configById"])


def _field(message: Any, path: str) -> Any:
    """What `pose.covariance[7]` leads to."""
    for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", path):
        message = getattr(message, name)
        if index:
            message = message[int(index)]
    return message


def _leaves(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else _leaves(tree["first"]) + _leaves(tree["second"])
