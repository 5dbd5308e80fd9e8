"""A floor is discovered by clicks on the mapper's page."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import compose, inverse, transform_points
from racecar.pipelines.studio.watch.watch_screen import GOAL
from tests.pipelines.live.page_stage import START, PageStage, distance, page_stage
from tests.pipelines.live.stage import mapper, wait_for

MAP_FROM_PLAN = inverse(START)
"""The map begins where the car stands."""


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageStage]:
    def make(node: Any, view: Any) -> Any:
        return mapper(node, tmp_path_factory.mktemp("out"), view)

    with page_stage("racecar_mapper", make, tells_places=False) as stage:
        stage.choose(GOAL)
        stage.click(np.array([1.0, 0.0]))
        stage.await_words("There is no map yet to click on")
        stage.live.start()
        stage.await_words("There is no map yet.")
        stage.start_car()
        yield stage
        stage.live.stop()


def await_arrival(stage: PageStage, true_goal: np.ndarray) -> None:
    wait_for(
        lambda: distance(stage.car.truth, true_goal) < 0.3 and not stage.car.is_underway, stage.said, 30.0
    )


def test_a_clicked_goal_on_the_growing_map_is_driven_to(stage: PageStage) -> None:
    true_goal = np.array([6.0, 4.5])
    stage.click(transform_points(MAP_FROM_PLAN, true_goal[None])[0])
    stage.await_words("went to car1/racecar_simulator (on /car1/goal_pose).")
    await_arrival(stage, true_goal)
    wait_for(
        lambda: bool(stage.said()) and stage.view._way.content == "The car is at the goal.", stage.said, 5.0
    )


def test_a_dragged_goal_is_reached_with_its_heading(stage: PageStage) -> None:
    true_goal = np.array([6.0, 2.0, -np.pi / 2])
    goal = compose(MAP_FROM_PLAN, true_goal)
    stage.drag(goal[:2], goal[:2] + np.array([np.cos(goal[2]), np.sin(goal[2])]))
    wait_for(lambda: stage.car.is_underway, stage.said, 5.0)
    await_arrival(stage, true_goal)
    assert stage.car.truth[2] == pytest.approx(true_goal[2], abs=0.3)


def test_the_panel_says_how_much_is_mapped(stage: PageStage) -> None:
    stage.await_words(" m** driven, ")
    assert float(stage.said().split("**")[1].removesuffix(" m")) > 5.0
    stage.await_words("The map is judged once a minute.")


def test_a_worker_that_is_busy_in_a_silence_is_not_taken_to_drop_messages(
    stage: PageStage, monkeypatch: pytest.MonkeyPatch
) -> None:
    mapper = stage.live
    stage.bus.are_workers_held_up = True
    monkeypatch.setattr(mapper.health, "silence", lambda what: 0.7)
    for _ in range(3):
        mapper.watch()
    stage.bus.are_workers_held_up = False
    assert not mapper.worker.dropped
    assert "too_fast" not in mapper.faults.counts


def test_what_is_clicked_while_the_node_ends_is_not_sent(
    stage: PageStage, caplog: pytest.LogCaptureFixture
) -> None:
    stage.live._display.end("The drive is over.")
    stage.click(np.array([0.0, 0.0]))
    stage.await_words("Nothing is sent any more")
    assert not caplog.messages
