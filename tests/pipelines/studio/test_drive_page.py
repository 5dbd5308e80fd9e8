"""A car that is driven on the page, by clicks in a browser."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.page_options import PageFlags
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.studio.drive.drive_screen import DriveScreen
from racecar.pipelines.studio.drive.follower import Follower
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan
from tests.pipelines.simulation.test_driven_simulation import a_room
from tests.pipelines.studio.chromium import Opened, opened, running

GOAL = (6.0, 4.5)


class Drive:
    """A page and the screen behind it."""

    screen: DriveScreen
    page: Opened


@pytest.fixture
def drive(chromium: Any) -> Iterator[Drive]:
    made = Drive()

    def make(studio: Any) -> DriveScreen:
        grid = a_room()
        simulation = DrivenSimulation(grid, Conditions())
        made.screen = DriveScreen(
            studio, grid, simulation, LocalizationConfig(particles=500), MappingConfig()
        )
        return made.screen

    with running(make) as studio, opened(chromium, studio) as made.page:
        yield made


def send_to_goal(drive: Drive) -> None:
    """Click until the car sets off: on a busy machine a page that has just loaded may miss a click."""
    drive.page.wait_for(lambda: drive.screen.is_underway or drive.page.click(GOAL), "the car to set off")


class Still(Follower):
    """An estimate that stays where it is."""

    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        self.note_error(np.zeros(3), truth, seconds)

    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        return None

    def words(self) -> str:
        return ""


def test_it_is_told_how_long_a_car_that_was_carried_away_was_astray_and_the_curve_keeps_that() -> None:
    follower = Still()
    for seconds, off in ((0.0, 0.1), (0.1, 9.0), (0.5, 8.0), (0.8, 0.5), (0.9, 0.1), (1.0, 0.1)):
        follower.take([], np.array([off, 0.0, 0.0]), seconds)
    assert follower.found_after == pytest.approx(0.8)
    assert max(error.metres for error in follower.errors) == 9.0


def a_drive(page: Page) -> DriveScreen:
    grid = a_room()
    simulation = DrivenSimulation(grid, Conditions())
    return DriveScreen(page, grid, simulation, LocalizationConfig(particles=500), MappingConfig())


def test_nothing_of_the_localizer_stands_beside_a_floor_that_is_discovered() -> None:
    with closing(Page("a drive", 0)) as page:
        page._screen = screen = a_drive(page)
        for _ in range(30):
            screen.step(0.1)
            screen.draw()
        screen._due_at.clear()
        screen.draw()
        assert len(screen._curve.data[0]) > 1
        assert "Known" in page.frame._headline.content
        screen._toggle_discovery()
        assert not screen._localizer_folder.visible
        assert not np.any(screen._curve.data[1])
        screen.step(0.1)
        screen.draw()
        assert "Known" not in page.frame._headline.content
        assert "localizer" not in screen._state.content
        screen._toggle_discovery()
        assert screen._localizer_folder.visible


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_discovered_floor_is_saved_where_nobody_can_be_asked(
    number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "discovered").mkdir(parents=True)
    (tmp_path / "runs" / "discovered" / "map.yaml").touch()

    def prepare(page: Page) -> Callable[[], DriveScreen]:
        screen = a_drive(page)
        screen._toggle_discovery()
        for _ in range(20):
            screen.step(0.1)
        return lambda: screen

    before = {each: signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)}
    try:
        PageFlags(browser=False).serve(prepare, Config(), lambda _address: os.kill(os.getpid(), number))
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
    assert (load_map(tmp_path / "runs" / "discovered-2").cells > 50).any()


@pytest.mark.slow
def test_the_car_drives_to_a_clicked_goal_and_the_localizer_follows(drive: Drive) -> None:
    screen, page = drive.screen, drive.page
    send_to_goal(drive)
    page.wait_for(lambda: np.linalg.norm(screen.truth[:2] - GOAL) < 0.3 and not screen.is_underway, "arrival")
    page.wait_for(lambda: screen.error < 0.1, "the localizer to know its place")
    assert page.asked_hosts == {LOOPBACK}


@pytest.mark.slow
def test_a_dragged_pose_makes_the_courses_filter_converge(drive: Drive) -> None:
    screen, page = drive.screen, drive.page
    page.tab.get_by_label("The course's filter, too").click()
    page.wait_for(lambda: (screen.course_error or 9.0) < 0.3, "the course's filter to run")
    page.choose("Tool", "Carry the car")
    page.drag(GOAL, (6.0, 3.5))
    page.wait_for(lambda: (screen.course_error or 0.0) > 2.0, "the car to be carried")
    np.testing.assert_allclose(screen.truth, [*GOAL, -np.pi / 2], atol=0.1)
    page.choose("Tool", "2D Pose Estimate")
    page.drag(GOAL, (6.0, 3.5))
    page.wait_for(lambda: (screen.course_error or 9.0) < 0.3, "the filter to believe the dragged pose")


@pytest.mark.slow
def test_a_kidnapped_car_is_found_again(drive: Drive) -> None:
    screen, page = drive.screen, drive.page
    start = screen.truth
    page.press("Kidnap the car")
    page.wait_for(lambda: not np.allclose(screen.truth, start, atol=0.01), "the car to be carried off")
    page.press("Global localization")
    page.wait_for(lambda: screen.error < 0.2, "the car to be found")


@pytest.mark.slow
def test_a_floor_is_discovered_and_its_map_saved(
    drive: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    screen, page = drive.screen, drive.page
    monkeypatch.chdir(tmp_path)
    page.tab.get_by_text("Discover the floor").click()
    page.press("Discover this floor")
    page.wait_for(lambda: page.says("keyframes"), "the mapper to begin")
    send_to_goal(drive)
    page.wait_for(lambda: np.linalg.norm(screen.truth[:2] - GOAL) < 0.3 and not screen.is_underway, "arrival")
    page.press("Save the map")
    page.wait_for(lambda: page.says("Saved in"), "the map to be saved")
    grid = load_map(tmp_path / "runs" / "discovered")
    assert np.count_nonzero(grid.cells == 0) * grid.resolution**2 > 20.0
