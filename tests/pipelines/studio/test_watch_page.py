"""What a node shows on the page, without a node."""

from typing import Any

import numpy as np
import pytest

from racecar.pipelines.live.display.browser_view import live_view
from racecar.pipelines.studio.page import LOOPBACK, Page
from racecar.pipelines.studio.palette import CAR
from racecar.pipelines.studio.watch.watch_room import Glimpse, WatchRoom
from tests.pipelines.simulation.test_driven_simulation import a_room
from tests.pipelines.studio.chromium import opened, running

POSE = np.array([4.5, 3.0, 0.0])


def test_a_page_is_there_while_it_is_wanted() -> None:
    with live_view("a node", None) as view:
        assert view.page.startswith(f"http://{LOOPBACK}:")
        view.show_map(a_room())
        view.show(POSE, np.ones((5, 2)), np.array([POSE, POSE]), np.tile(POSE, (4000, 1)))


@pytest.mark.slow
def test_the_latest_is_seen_and_the_car_followed(chromium: Any) -> None:
    rooms: list[WatchRoom] = []

    def make(studio: Page) -> WatchRoom:
        rooms.append(WatchRoom(studio))
        return rooms[0]

    with running(make) as studio, opened(chromium, studio) as page:
        studio.request(lambda: rooms[0].take_map(a_room()))
        page.wait_for(lambda: np.any(page.pixels() < 60), "the map")
        studio.request(lambda: rooms[0].take(Glimpse(POSE, np.ones((5, 2)), np.tile(POSE, (2, 1)), None)))
        car = np.array(CAR)
        page.wait_for(lambda: np.any(np.all(np.abs(page.pixels() - car) < 30, axis=2)), "the car")
