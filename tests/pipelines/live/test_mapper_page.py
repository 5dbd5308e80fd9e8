"""A floor is discovered by clicks on the mapper's page: simulated car, mapper and page talk over DDS."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation
from racecar.pipelines.studio.watch.tools import NodeTool
from tests.pipelines.live.live_car import wait_for
from tests.pipelines.live.page_stage import Clicker, distance, page_and_node, simulated_car

ARRIVED = 0.3
"""Metres."""


@dataclass
class Stage:
    """The node under test, its page, and the car."""

    mapper: Any
    clicker: Clicker
    car: DrivenSimulation
    begin: Pose
    """Where the car truly stood when its map began."""

    def drive_to(self, true_goal: np.ndarray) -> None:
        wait_for(
            lambda: distance(self.car.truth, true_goal) < ARRIVED and not self.car.is_underway,
            30.0,
            lambda: f"{self.car.truth}, not {true_goal}; {self.clicker.said()}",
        )


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    from racecar.pipelines.live.mapper_node import MapperNode
    from racecar.pipelines.live.ros.run import served
    from racecar.pipelines.live.saving.drive_log import DriveLog
    from racecar.pipelines.live.saving.map_saving import MapOutput

    out: Path = tmp_path_factory.mktemp("out")
    output = MapOutput(out, Config(), {"live": True})
    with page_and_node("racecar_mapper", [NodeTool.MOVE, NodeTool.GOAL]) as (clicker, node):
        mapper = MapperNode(node, output, DriveLog(out), clicker.view)
        clicker.choose(NodeTool.GOAL)
        clicker.click(np.array([1.0, 0.0]))
        clicker.await_words("There is no map yet to click on")
        mapper.start()
        with served(node):
            clicker.await_words("There is no map yet.")
            with simulated_car() as car:
                clicker.await_car()
                yield Stage(mapper, clicker, car, car.truth)
        mapper.stop()


def test_a_clicked_goal_on_the_growing_map_is_driven_to(stage: Stage) -> None:
    true_goal = np.array([6.0, 4.5])
    stage.clicker.click(transform_points(inverse(stage.begin), true_goal[None])[0])
    stage.clicker.await_words("went to car1/racecar_simulator (on /car1/goal_pose).")
    stage.drive_to(true_goal)
    wait_for(lambda: stage.clicker.room._way.content == "The car is at the goal.", 5.0, stage.clicker.said)


def test_a_dragged_goal_is_reached_with_its_heading(stage: Stage) -> None:
    true_goal = np.array([6.0, 2.0, -np.pi / 2])
    goal = compose(inverse(stage.begin), true_goal)
    ahead = np.array([np.cos(goal[2]), np.sin(goal[2])])
    stage.clicker.drag(goal[:2], goal[:2] + ahead)
    wait_for(lambda: stage.car.is_underway, 5.0, stage.clicker.said)
    stage.drive_to(true_goal)
    assert stage.car.truth[2] == pytest.approx(true_goal[2], abs=0.3)


def test_the_panel_says_how_much_is_mapped(stage: Stage) -> None:
    stage.clicker.await_words(" m** driven, ")
    metres = float(stage.clicker.room._state.content.split("**")[1].removesuffix(" m"))
    assert metres > 5.0
    stage.clicker.await_words("The map is judged once a minute.")


def test_a_worker_that_is_busy_in_a_silence_is_not_taken_to_drop_messages(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    mapper, goes_on = stage.mapper, Event()
    mapper.worker.inbox.put("save", goes_on.wait)
    monkeypatch.setattr(mapper.health, "silence", lambda what: 0.7)
    for _ in range(3):
        mapper.watch()
    goes_on.set()
    assert not mapper.worker.inbox.dropped
    assert "too_fast" not in mapper.faults.counts


def test_what_is_clicked_while_the_node_ends_is_not_sent(
    stage: Stage, caplog: pytest.LogCaptureFixture
) -> None:
    stage.mapper._display.end()
    stage.clicker.click(np.array([0.0, 0.0]))
    stage.clicker.await_words("Nothing is sent any more")
    assert not caplog.messages
