"""What a node shows on the page, and what is clicked there, without a node."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial
from html import unescape
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.runs.view.headline import Headline
from racecar.pipelines.studio.page import Page, open_beside
from racecar.pipelines.studio.palette import CAR, LOOP
from racecar.pipelines.studio.pointed import Pointed
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.watch.watch_screen import GOAL, MOVE, PLACE, WatchScreen
from tests.pipelines.simulation.test_driven_simulation import a_room
from tests.pipelines.studio.chromium import Opened, opened, running

POSE, THERE = np.array([4.5, 3.0, 0.0]), np.array([6.5, 5.0])
FAR = np.array([3.0, 0.0])
"""A long drag, to the right."""


class Watched:
    """A screen and what was sent from it."""

    def __init__(self, page: Page) -> None:
        self.page, self.screen = page, WatchScreen(page, tells_places=True)
        self.goals: list[Pose] = []
        self.places: list[Pointed] = []

    @property
    def tool(self) -> Any:
        return self.screen.tool

    def connect(self) -> None:
        self.screen.connect(self._send_goal, self._send_place)
        self.page._take_requests()

    def see_map(self) -> None:
        self.screen.show_map(a_room())
        self.page._take_requests()

    def see(self, pose: Pose) -> None:
        """The car is there, and that is drawn."""
        self.screen.show(pose, np.ones((5, 2)), np.tile(POSE, (2, 1)))
        self.page._take_requests()
        self.screen.draw()

    def words(self) -> tuple[str, str]:
        """What became of the last click, and how far the goal is."""
        return self.screen._outcome.content, self.screen._way.content

    @property
    def draws_goal(self) -> bool:
        return "goal" in self.page.layers._handles

    def _send_goal(self, map_from_goal: Pose) -> str:
        self.goals.append(map_from_goal)
        return "The goal went to a navigation."

    def _send_place(self, shown: Pointed) -> str:
        self.places.append(shown)
        return "The place went to a localizer."


@pytest.fixture
def watched() -> Iterator[Watched]:
    with closing(Page("a node", 0)) as page:
        yield Watched(page)


@pytest.fixture
def shown(watched: Watched) -> Watched:
    """One that sees a map and a car."""
    watched.connect()
    watched.see_map()
    watched.see(POSE)
    return watched


def test_a_page_is_there_while_it_is_wanted() -> None:
    with open_beside("a node", 0, partial(WatchScreen, tells_places=False)) as (page, view):
        assert page.address.startswith(f"http://{LOOPBACK}:")
        view.show_map(a_room())
        view.show(POSE, np.ones((5, 2)), np.array([POSE, POSE]), np.tile(POSE, (4000, 1)))


def test_nothing_is_sent_before_a_tool_is_chosen(shown: Watched) -> None:
    assert not shown.tool.takes_drag(np.zeros(2))
    shown.tool.click(THERE)
    shown.tool.drag(THERE, THERE + FAR, is_over=True)
    assert not shown.goals
    assert not shown.places


def test_a_clicked_goal_looks_ahead_from_the_car_and_a_dragged_one_along_the_drag(shown: Watched) -> None:
    shown.screen.tools.choose(GOAL)
    assert shown.tool.takes_drag(np.zeros(2))
    shown.tool.click(THERE)
    shown.tool.drag(THERE, THERE + FAR / 2, is_over=False)
    assert len(shown.goals) == 1
    shown.tool.drag(THERE, THERE + FAR, is_over=True)
    np.testing.assert_allclose(shown.goals, [[*THERE, np.pi / 4], [*THERE, 0.0]])
    shown.tool.click(POSE[:2] + 0.01)
    assert shown.goals[-1][2] == POSE[2]


def test_the_way_to_the_goal_is_told_until_the_car_is_there(shown: Watched) -> None:
    shown.screen.tools.choose(GOAL)
    shown.tool.click(THERE)
    assert shown.words()[0] == "The goal went to a navigation."
    shown.see(POSE)
    assert shown.words()[1] == "2.8 m to the goal."
    assert shown.draws_goal
    shown.see(np.array([6.5, 4.0, 1.0]))
    assert shown.words()[1] == "1.0 m to the goal."
    shown.see(np.array([6.4, 4.9, 1.0]))
    assert shown.words()[1] == "The car is at the goal."
    assert not shown.draws_goal
    shown.see(POSE)
    assert shown.words()[1] == "The car is at the goal."


def test_a_place_is_dragged_with_a_heading_or_clicked_without_one(shown: Watched) -> None:
    shown.screen.tools.choose(PLACE)
    shown.tool.drag(THERE, THERE - FAR, is_over=True)
    shown.tool.drag(THERE, THERE + 0.01, is_over=True)
    dragged, clicked = shown.places
    assert dragged.heading == pytest.approx(np.pi)
    assert clicked.heading is None
    assert not shown.goals


@pytest.mark.parametrize("tool", [GOAL, PLACE])
def test_a_click_before_there_is_a_map_gets_a_sentence(watched: Watched, tool: str) -> None:
    watched.screen.tools.choose(tool)
    with pytest.raises(UserError, match="no map yet"):
        watched.tool.click(THERE)
    watched.connect()
    with pytest.raises(UserError, match="no map yet"):
        watched.tool.click(THERE)
    assert "no map yet" in watched.words()[0]
    assert not watched.goals
    assert not watched.places


def test_the_view_follows_the_car_until_a_person_moves_the_map(shown: Watched) -> None:
    followed: list[list[float]] = []
    shown.page.view.follow = lambda place: followed.append(place.tolist())  # type: ignore[method-assign]
    shown.see(np.array([4.8, 3.0, 0.0]))
    assert followed == [[4.8, 3.0]]
    shown.page.view.was_moved = True
    shown.see(POSE)
    assert len(followed) == 1
    assert not shown.screen.watched._follows.value


def test_a_goal_before_the_first_pose_needs_a_direction(watched: Watched) -> None:
    watched.connect()
    watched.see_map()
    watched.screen.tools.choose(GOAL)
    with pytest.raises(UserError, match="not known yet where the car is"):
        watched.tool.click(THERE)
    watched.tool.drag(THERE, THERE + FAR, is_over=True)
    np.testing.assert_allclose(watched.goals, [[*THERE, 0.0]])


def test_a_goal_that_nobody_hears_is_told_and_not_drawn(shown: Watched) -> None:
    def send(_: Pose) -> str:
        raise UserError("Nobody listens on /goal_pose.")

    shown.screen.connect(send)
    shown.page._take_requests()
    shown.screen.tools.choose(GOAL)
    with pytest.raises(UserError, match="Nobody listens"):
        shown.tool.click(THERE)
    assert unescape(shown.words()[0]) == "Nobody listens on /goal_pose."
    assert not shown.draws_goal


def near(picture: np.ndarray, color: tuple[int, int, int]) -> bool:
    return bool(np.any(np.all(np.abs(picture.astype(int) - np.array(color)) < 30, axis=2)))


def choose(page: Opened, tool: str) -> None:
    page.choose("Tool", tool)
    page.wait_for(
        lambda: page.studio._screen.tool.takes_drag(np.zeros(2)) == (tool != MOVE), "the tool to be chosen"
    )


@pytest.mark.slow
def test_goals_are_clicked_and_dragged_on_two_pages_and_come_back_after_one_is_closed(chromium: Any) -> None:
    screens: list[Watched] = []

    def make(studio: Page) -> WatchScreen:
        screens.append(Watched(studio))
        screens[0].connect()
        return screens[0].screen

    with running(make) as studio:
        watched = screens[0]
        with opened(chromium, studio) as page:
            watched.screen.show_map(a_room())
            page.wait_for(lambda: near(page.pixels(), (27, 31, 36)), "the map")
            watched.screen.show(POSE, np.ones((5, 2)), np.tile(POSE, (2, 1)))
            page.wait_for(lambda: near(page.pixels(), CAR), "the car")
            page.drag((5.5, 3.0), (5.0, 3.0))
            page.click((5.0, 4.0))
            page.tab.wait_for_timeout(500)
            assert not watched.goals
            choose(page, GOAL)
            page.wait_for(lambda: watched.goals or page.click((5.0, 4.0)), "a clicked goal")
            count = len(watched.goals)
            page.drag((5.0, 4.0), (5.0, 5.0))
            page.wait_for(lambda: len(watched.goals) > count, "a dragged goal")
            np.testing.assert_allclose(watched.goals[-1], [5.0, 4.0, np.pi / 2], atol=0.1)
            watched.screen.show(POSE, np.ones((5, 2)), np.tile(POSE, (2, 1)))
            with opened(chromium, studio) as second:
                second.wait_for(lambda: second.says("1.1 m to the goal."), "the goal on the other page")
                second.wait_for(lambda: near(second.pixels(), LOOP), "its cross")
                assert second.list_of("Tool").input_value() == GOAL
        watched.screen.tell(Headline("Known ± 3 cm"), "The car is somewhere.")
        with opened(chromium, studio) as page:
            page.wait_for(lambda: page.says("The car is somewhere."), "the state")
            assert page.says("Known ± 3 cm")
            page.wait_for(lambda: near(page.pixels(), CAR) and near(page.pixels(), LOOP), "car and goal")
            assert page.says("The goal went to a navigation.")
            assert page.asked_hosts == {LOOPBACK}
