"""The pages of live nodes, each node a process, in a real browser."""

import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import compose
from racecar.maps.map_files import load_map
from racecar.pipelines.live.ros.processes import racecar_process
from tests.pipelines.live.simulated_driver import Driver
from tests.pipelines.studio.chromium import Tab, new_tab

START = np.array([2.0, 0.0, 0.0])
"""In a corridor of the building."""
PATIENCE = 120.0
"""Seconds: a browser without graphics keeps both cores busy."""


class NodeTab(Tab):
    """A node's page in a browser."""

    def __init__(self, tab: Any, log: Path) -> None:
        super().__init__(tab)
        self._log = log
        self.until(lambda: "Look at http://" in log.read_text(), "the address")
        tab.goto(log.read_text().split("Look at ")[1].split()[0])

    def until(self, is_true: Callable[[], Any], what: str) -> None:
        self.wait_for(is_true, what, lambda: f"{self.text}; {self._log.read_text()[-2000:]}")

    def await_words(self, words: str) -> None:
        self.until(lambda: self.says(words), words)

    @property
    def text(self) -> str:
        return str(self.tab.inner_text("body"))

    def click_the_middle(self) -> bool:
        """Of the map's part of the page."""
        box = self.tab.locator("canvas").first.bounding_box()
        self.tab.mouse.click(box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0)
        return False


@pytest.fixture
def open_tab(chromium: Any) -> Iterator[Callable[[Path], NodeTab]]:
    """Opens the page of the node that writes a log."""
    with ExitStack() as tabs:
        yield lambda log: NodeTab(tabs.enter_context(new_tab(chromium)), log)


def end(process: subprocess.Popen[bytes], log: Path) -> None:
    """By Ctrl-C; it must end well, and without a traceback."""
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0, log.read_text()
    assert "Traceback" not in log.read_text()


@pytest.mark.slow
def test_a_floor_is_discovered_by_clicks_in_a_browser(
    ros: dict[str, str], open_tab: Callable[[Path], NodeTab], tmp_path: Path
) -> None:
    from racecar.pipelines.live.ros.run import ros_node, served

    log, out = tmp_path / "log", tmp_path / "out"
    log.touch()
    simulate = ["live", "simulate", "--map", "building", "--start", *map(str, START)]
    mapping = ["live", "map", "--out", str(out), "--view"]
    with (
        ros_node("test_driver", []) as node,
        racecar_process(simulate, ros, tmp_path / "simulator"),
        racecar_process(mapping, ros, log) as mapper,
    ):
        driver = Driver(node)
        with served(node):
            tab = open_tab(log)
            tab.await_words("keyframe")
            tab.click_the_middle()
            tab.choose("Tool", "2D Goal Pose")
            tab.await_words("Click where the car shall go")
            assert "went to" not in tab.text
            tab.until(lambda: "went to racecar_simulator" in tab.text or tab.click_the_middle(), "a goal")
            tab.await_words("The car is at the goal.")
            sent = re.search(r"The goal x (\S+) m, y (\S+) m, heading (\S+)°", tab.text)
            assert sent is not None
            goal = np.array([float(number) for number in sent.groups()])
            assert np.hypot(*goal[:2]) > 2.0
            true_goal = compose(START, [goal[0], goal[1], np.radians(goal[2])])
            tab.until(lambda: driver.speed == 0.0, "the car to stand")
            assert driver.distance_to(true_goal) < 0.3
        tab.tab.close()
        tab = open_tab(log)
        tab.await_words("The car is at the goal.")
        assert tab.list_of("Tool").input_value() == "2D Goal Pose"
        end(mapper, log)
    assert np.count_nonzero(load_map(out).cells == 0) > 1000


@pytest.mark.slow
def test_a_localizer_takes_another_port_and_ends_quietly_while_a_page_is_open(
    ros: dict[str, str], open_tab: Callable[[Path], NodeTab], tmp_path: Path
) -> None:
    log = tmp_path / "log"
    log.touch()
    localize = ["live", "localize", "--map", "building", "--global", "--no-memory", "--view"]
    with racecar_process([*localize, "--view-port", "65535"], ros, tmp_path / "first") as first:
        open_tab(tmp_path / "first").await_words("No pose yet")
        with racecar_process([*localize, "--view-port", "65535"], ros, log) as second:
            tab = open_tab(log)
            tab.await_words("Nothing has arrived on /scan yet")
            tab.choose("Tool", "2D Goal Pose")
            tab.await_words("Click where the car shall go")
            tab.until(
                lambda: "It is not known yet where the car is" in tab.text or tab.click_the_middle(), "words"
            )
            end(second, log)
        end(first, tmp_path / "first")
    said = log.read_text()
    assert said.count("The page is not at port 65535 (Address already in use): a free one is taken.") == 1
