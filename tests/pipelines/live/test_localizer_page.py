"""The localizer is told on its page where the car is, over DDS, and outlives the page."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from racecar.localization.recovery import hypotheses
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation
from racecar.pipelines.studio import page as page_module
from racecar.pipelines.studio.watch.tools import NodeTool
from tests.pipelines.live.live_car import wait_for
from tests.pipelines.live.page_stage import START, Clicker, distance, page_and_node, simulated_car
from tests.pipelines.simulation.test_driven_simulation import GRID

ELSEWHERE = np.array([6.0, 4.5, -np.pi / 2])


@dataclass
class Stage:
    """The node under test, its page, and the car."""

    localizer: Any
    clicker: Clicker
    car: DrivenSimulation

    @property
    def error(self) -> float:
        """Metres and radians from the truth."""
        estimate, truth = self.localizer._estimate, self.car.truth
        if estimate is None:
            return float("inf")
        off = estimate.map_from_base - truth
        return distance(estimate.map_from_base, truth) + abs(float(np.sin(off[2] / 2))) * 2.0

    def carry_to(self, pose: Pose) -> None:
        """Neither wheels nor laser notice the way."""
        self.car.put_at(pose)
        wait_for(lambda: self.error > 2.0, 5.0, lambda: str(self.error))

    def await_right(self) -> None:
        wait_for(lambda: self.error < 0.1, 10.0, lambda: f"off by {self.error}; {self.clicker.said()}")


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart
    from racecar.pipelines.live.ros.run import served

    with (
        pytest.MonkeyPatch.context() as patch,
        page_and_node("racecar_localizer", list(NodeTool)) as (clicker, node),
    ):
        patch.setattr(hypotheses, "_SEARCH_FROM", 1.0)  # of what it is not told it finds nothing
        start = LocalizerStart(grid=GRID, initial_pose=START)
        localizer = LocalizerNode(node, Config(), start, clicker.view)
        localizer.start()
        with served(node):
            clicker.await_words("There is no pose yet.")
            with simulated_car() as car:
                clicker.await_car()
                yield Stage(localizer, clicker, car)
        localizer.stop()


def test_the_panel_says_how_sure_the_place_is(stage: Stage) -> None:
    stage.await_right()
    stage.clicker.await_words("**The place is known**: ± ")


def test_a_dragged_pose_makes_the_filter_converge(stage: Stage) -> None:
    stage.carry_to(ELSEWHERE)
    stage.clicker.await_words("The car is lost")
    stage.clicker.choose(NodeTool.PLACE)
    shown = ELSEWHERE[:2] + np.array([0.1, -0.1])
    stage.clicker.drag(shown, shown + np.array([0.0, -1.0]))
    stage.clicker.await_words("heading -90° (± ")
    stage.clicker.await_words("went to car1/racecar_localizer (on /car1/initialpose).")
    stage.await_right()
    stage.clicker.await_words("**The place is known**: ± ")


def test_a_clicked_place_is_enough_and_the_heading_is_found(stage: Stage) -> None:
    stage.carry_to(START)
    stage.clicker.choose(NodeTool.PLACE)
    stage.clicker.click(START[:2] + np.array([-0.2, 0.2]))
    stage.clicker.await_words("heading unknown, went to car1/racecar_localizer (on /car1/clicked_point).")
    stage.await_right()


def test_a_place_in_a_wall_is_refused_in_words(stage: Stage) -> None:
    stage.clicker.choose(NodeTool.PLACE)
    stage.clicker.drag(np.array([40.0, 40.0]), np.array([41.0, 40.0]))
    stage.clicker.await_words("is not on the map's free space")
    stage.await_right()


def test_a_goal_is_driven_to_and_the_car_is_localized_on_its_way(stage: Stage) -> None:
    stage.clicker.choose(NodeTool.GOAL)
    stage.clicker.click(np.array([2.5, 4.5]))
    stage.clicker.await_words("went to car1/racecar_simulator (on /car1/goal_pose).")
    wait_for(lambda: distance(stage.car.truth, np.array([2.5, 4.5])) < 0.3, 20.0, stage.clicker.said)
    stage.await_right()


def test_the_node_goes_on_when_the_pages_server_is_gone(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(page_module, "_LOOK_EVERY", 0.1)
    page = stage.clicker.view._page
    page.server.stop()
    wait_for(lambda: bool(caplog.messages), 5.0, lambda: "nothing is told of the page")
    poses = stage.localizer.health.count("poses")
    time.sleep(1.0)
    assert stage.localizer.health.count("poses") > poses + 20
    stage.await_right()
    assert caplog.messages == [
        f"The page at {page.address} can no longer be reached, and is not drawn any more."
    ]
    assert not [name for name in stage.localizer.faults.counts if name.startswith("internal")]
