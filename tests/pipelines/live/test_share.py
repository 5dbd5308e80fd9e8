"""The files to start nodes with fit the nodes."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

import racecar.pipelines.live
from racecar.pipelines.commands.cli import app
from tests.pipelines.simulation.test_driven_simulation import GRID

SHARE = Path(racecar.pipelines.live.__file__).parent / "share"


def test_the_command_names_the_folder() -> None:
    result = CliRunner().invoke(app, ["live", "files"])
    assert Path(result.output.strip()) == SHARE


@pytest.mark.parametrize("name", ["localize", "map", "simulate"])
def test_a_launch_file_starts_a_command_that_there_is(name: str) -> None:
    command = _commands(name)[0]
    assert command.startswith(f"racecar live {name} ")
    own, _, ros = command.partition("--ros-args")
    flags = {word for word in own.split() if word.startswith("--")}
    shown = CliRunner().invoke(app, ["live", name, "--help"], env={"COLUMNS": "200"}).output
    assert all(flag in shown for flag in flags)
    assert f"--params-file $(var params) {_remapped(name)}".rstrip() == ros.strip()


@pytest.mark.parametrize("name", ["localize", "map", "simulate"])
def test_a_launch_file_uses_its_arguments_and_names_files_that_there_are(name: str) -> None:
    root = ElementTree.parse(SHARE / f"{name}.launch.xml").getroot()
    texts = [value for each in root.iter() for value in each.attrib.values()]
    used = {variable for text in texts for variable in re.findall(r"\$\(var (\w+)\)", text)}
    assert used == {argument.get("name") for argument in root.findall("arg")}
    named = [file for text in texts for file in re.findall(r"\$\(dirname\)/(\S+)", text)]
    assert [file for file in named if not (SHARE / file).is_file()] == []
    assert f"rviz2 -d $(dirname)/{name}.rviz" in _commands(name) or name == "simulate"


def _commands(name: str) -> list[str]:
    root = ElementTree.parse(SHARE / f"{name}.launch.xml").getroot()
    return [str(each.get("cmd")) for each in root.findall("executable")]


def _remapped(name: str) -> str:
    """The topics whose names differ from car to car; the simulated car has its own."""
    topics = () if name == "simulate" else ("scan", "odom", "imu")
    return " ".join(f"-r {topic}:=$(var {topic})" for topic in topics)


@pytest.mark.parametrize("kind", ["localizer", "mapper", "simulator"])
def test_every_parameter_that_is_explained_is_declared(kind: str) -> None:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.live.ros.run import ros_node

    told = yaml.safe_load((SHARE / f"{kind}.yaml").read_text())["/**"]["ros__parameters"]
    with ros_node("test_parameters", ["--ros-args", "--params-file", str(SHARE / f"{kind}.yaml")]) as node:
        if kind == "localizer":
            from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart

            LocalizerNode(node, Config(), LocalizerStart(None))
        elif kind == "simulator":
            from racecar.pipelines.live.simulator_node import SimulatorNode
            from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation

            SimulatorNode(node, DrivenSimulation(GRID, Conditions()), pace=1.0, teleports=False)
        else:
            from racecar.pipelines.files.config_file import Config
            from racecar.pipelines.live.mapper_node import MapperNode
            from racecar.pipelines.live.saving.drive_log import DriveLog
            from racecar.pipelines.live.saving.map_saving import MapOutput

            MapperNode(node, MapOutput(Path("nowhere"), Config(), {}), DriveLog(Path("nowhere")))
        declared = {name: parameter.value for name, parameter in node._parameters.items()}
    for name, value in told.items():
        assert name in declared
        assert list(declared[name]) == value if isinstance(value, list) else declared[name] == value
