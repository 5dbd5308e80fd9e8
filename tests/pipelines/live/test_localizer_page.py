"""The localizer is told on its page where the car is, and outlives the page."""

import time
from collections.abc import Iterator
from threading import Event
from typing import Any

import numpy as np
import pytest

from racecar.localization.recovery import hypotheses
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.studio import page as page_module
from racecar.pipelines.studio.watch.watch_screen import GOAL, PLACE
from tests.pipelines.live.page_stage import START, PageStage, distance, page_stage
from tests.pipelines.live.stage import localizer, wait_for
from tests.pipelines.simulation.test_driven_simulation import GRID

ELSEWHERE = np.array([6.0, 4.5, -np.pi / 2])


@pytest.fixture(scope="module")
def stage() -> Iterator[PageStage]:
    def make(node: Any, view: Any) -> Any:
        return localizer(node, view, grid=GRID, initial_pose=START)

    with (
        pytest.MonkeyPatch.context() as patch,
        page_stage("racecar_localizer", make, tells_places=True) as stage,
    ):
        patch.setattr(hypotheses, "_SEARCH_FROM", 1.0)  # of what it is not told it finds nothing
        stage.live.start()
        stage.await_words("No pose yet")
        stage.start_car()
        yield stage
        stage.live.stop()


def error(stage: PageStage) -> float:
    """Metres and radians from the truth."""
    estimate, truth = stage.live._estimate, stage.car.truth
    off = estimate.map_from_base - truth
    return distance(estimate.map_from_base, truth) + abs(float(np.sin(off[2] / 2))) * 2.0


def carry_to(stage: PageStage, pose: Pose) -> None:
    """Neither wheels nor laser notice the way."""
    stage.car.put_at(pose)
    wait_for(lambda: error(stage) > 2.0, stage.said, 5.0)


def await_right(stage: PageStage) -> None:
    wait_for(lambda: error(stage) < 0.1, lambda: f"off by {error(stage)}; {stage.said()}", 10.0)


def test_the_panel_says_how_sure_the_place_is(stage: PageStage) -> None:
    await_right(stage)
    stage.await_words("Known ± ")


def test_a_dragged_pose_makes_the_filter_converge(stage: PageStage) -> None:
    carry_to(stage, ELSEWHERE)
    stage.await_words("Lost")
    stage.choose(PLACE)
    shown = ELSEWHERE[:2] + np.array([0.1, -0.1])
    stage.drag(shown, shown + np.array([0.0, -1.0]))
    stage.await_words("heading -90° (± ")
    stage.await_words("went to car1/racecar_localizer (on /car1/initialpose).")
    await_right(stage)
    stage.await_words("Known ± ")


def test_a_clicked_place_is_enough_and_the_heading_is_found(stage: PageStage) -> None:
    carry_to(stage, START)
    stage.choose(PLACE)
    stage.click(START[:2] + np.array([-0.2, 0.2]))
    stage.await_words("heading unknown, went to car1/racecar_localizer (on /car1/clicked_point).")
    await_right(stage)


def test_a_place_in_a_wall_is_refused_in_words(stage: PageStage) -> None:
    stage.choose(PLACE)
    stage.drag(np.array([40.0, 40.0]), np.array([41.0, 40.0]))
    stage.await_words("is not on the map's free space")
    await_right(stage)


def test_a_goal_is_driven_to_and_the_car_is_localized_on_its_way(stage: PageStage) -> None:
    stage.choose(GOAL)
    stage.click(np.array([2.5, 4.5]))
    stage.await_words("went to car1/racecar_simulator (on /car1/goal_pose).")
    wait_for(lambda: distance(stage.car.truth, np.array([2.5, 4.5])) < 0.3, stage.said, 20.0)
    await_right(stage)


def test_the_node_goes_on_when_the_pages_server_is_gone(
    stage: PageStage, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(page_module, "_LOOK_EVERY", 0.1)
    page = stage.page
    page.server.stop()
    wait_for(lambda: bool(caplog.messages) or Event().wait(0.05), lambda: "nothing is told of the page")
    poses = stage.live.health.count("poses")
    time.sleep(1.0)
    assert stage.live.health.count("poses") > poses + 20
    await_right(stage)
    assert caplog.messages == [
        f"The page at {page.address} can no longer be reached, and is not drawn any more."
    ]
    assert not [name for name in stage.live.faults.counts if name.startswith("internal")]
