"""A bag becomes a map on the page."""

import time
from collections.abc import Callable, Iterator
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OCCUPIED
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.studio.map_bag.map_bag_screen import MapBagScreen
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.studio import screen_for
from tests.pipelines.studio.chromium import opened, running

_PATIENCE = 60.0
"""Seconds: the process loads its libraries first."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive of some metres along the x axis."""
    path = tmp_path_factory.mktemp("drives") / "drive.bag"
    assert run(["simulate", "--map", "track", "--out", str(path), "--duration", "4", "--quiet"]) == 0
    return path


@pytest.fixture(scope="module")
def long_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One that takes a while to map."""
    path = tmp_path_factory.mktemp("drives") / "long.bag"
    assert run(["simulate", "--map", "track", "--out", str(path), "--duration", "40", "--quiet"]) == 0
    return path


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """A page without a browser; runs go to an empty folder."""
    monkeypatch.chdir(tmp_path)
    page = Page("racecar studio", 0)
    try:
        yield page
    finally:
        page.close()


def enter(page: Page, target: Path) -> MapBagScreen:
    page.enter(screen_for(page, target, load_config(None)))
    return screen_of(page)


def screen_of(page: Page) -> Any:
    return page._screen


def wait_for(page: Page, is_true: Callable[[], Any]) -> None:
    """Work as the page's worker does."""
    end = time.monotonic() + _PATIENCE
    while not is_true():
        assert time.monotonic() < end, f"{screen_of(page).words} {screen_of(page).remarks}"
        page._take_requests()
        page._step(0.05)
        time.sleep(0.02)


def test_a_bag_is_mapped_while_one_watches(page: Page, bag: Path, tmp_path: Path) -> None:
    screen = enter(page, bag)
    screen.map_it()
    assert "press again" in screen.would_be_lost
    with pytest.raises(UserError, match="already"):
        screen.check_it()
    wait_for(page, lambda: screen.watched.glimpse is not None)
    assert len(screen.watched.glimpse.scan_in_map) > 1000
    wait_for(page, lambda: screen.is_idle)
    assert "The map is" in screen.words
    assert screen.would_be_lost == ""
    folder = tmp_path / "runs/drive"
    assert read_report(folder).inputs.bag == str(bag)
    written = load_map(folder)
    assert screen.watched.grid is not None
    shown = screen.watched.grid.cells  # not those of the last sketch
    np.testing.assert_array_equal(shown >= 65, written.cells == OCCUPIED)
    screen.open_result()
    assert "LookScreen" in type(screen_of(page)).__name__


def test_a_run_is_only_replaced_when_asked_twice(page: Page, bag: Path, tmp_path: Path) -> None:
    screen = enter(page, bag)
    screen.map_it()
    wait_for(page, lambda: screen.is_idle)
    first = (tmp_path / "runs/drive/report.json").read_bytes()
    assert screen._out.value == "runs/drive-2"
    screen.choose(bag.name)
    assert screen._out.value == "runs/drive-2"
    screen._out.value = "runs/drive"
    with pytest.raises(UserError, match=r"results of `racecar map` for drive.bag, .* press again to replace"):
        screen.map_it()
    assert screen.is_idle
    assert (tmp_path / "runs/drive/report.json").read_bytes() == first
    screen.map_it()
    wait_for(page, lambda: screen.is_idle)
    assert (tmp_path / "runs/drive/report.json").read_bytes() != first


def test_a_bag_is_checked(page: Page, bag: Path) -> None:
    screen = enter(page, bag)
    screen.check_it()
    wait_for(page, lambda: screen.is_idle)
    assert "160 scans on /scan in 4 s" in screen.words


def test_what_was_read_until_one_stops_becomes_the_map(page: Page, long_bag: Path, tmp_path: Path) -> None:
    screen = enter(page, long_bag)
    screen.map_it()
    wait_for(page, lambda: screen.watched.glimpse is not None)
    screen.stop()
    wait_for(page, lambda: screen.is_idle)
    report = read_report(tmp_path / "runs/long")
    assert report.counts.interrupted
    assert report.counts.scans is not None
    assert 0 < report.counts.scans < 1600
    assert "The reading was stopped after" in screen.remarks


def test_a_process_that_is_stopped_before_it_reads_leaves_nothing(
    page: Page, bag: Path, tmp_path: Path
) -> None:
    screen = enter(page, bag)
    screen.map_it()
    screen.stop()
    wait_for(page, lambda: screen.is_idle)
    assert "no map was written" in screen.words
    assert not list((tmp_path / "runs").glob("*/*"))


def test_a_screen_that_is_left_ends_its_process(page: Page, long_bag: Path, tmp_path: Path) -> None:
    screen = enter(page, long_bag)
    screen.map_it()
    wait_for(page, lambda: screen.watched.glimpse is not None)
    leave = lambda: page.leave_for(lambda: screen_for(page, Path("track"), load_config(None)))  # noqa: E731
    with pytest.raises(UserError, match="still being read"):
        leave()
    leave()
    assert screen.is_idle
    assert not (tmp_path / "runs/long").exists()


def test_a_folder_that_cannot_be_made_is_a_users_mistake(page: Page, bag: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    screen = enter(page, bag)
    screen._out.value = str(tmp_path / "file" / "run")
    with pytest.raises(UserError, match="is a file: name another place"):
        screen.map_it()
    screen._out.value = "~nobody-of-this-name/run"
    with pytest.raises(UserError, match="cannot be a path"):
        screen.map_it()


def test_names_of_bags_are_shown_as_they_are(page: Page, bag: Path) -> None:
    name = "<b>*bold*_{x}.bag"
    (bag.parent / name).write_bytes(bag.read_bytes()[:5000])
    screen = enter(page, bag.parent)
    screen.choose(name)
    assert unescape(screen.words).endswith(name)
    assert not set(screen.words) & set("<*_{")


def test_a_bag_with_a_fault_is_explained_and_another_can_be_mapped(page: Page, bag: Path) -> None:
    (bag.parent / "cut.bag").write_bytes(bag.read_bytes()[:5000])
    screen = enter(page, bag.parent)
    screen.choose("cut.bag")
    screen.map_it()
    wait_for(page, lambda: screen.is_idle)
    assert "cut.bag" in screen.words
    screen.choose("drive.bag")
    screen.check_it()
    wait_for(page, lambda: screen.is_idle)
    assert "scans on /scan" in screen.words


@pytest.mark.parametrize(
    ("name", "words"),
    [("nowhere", "There is no nowhere"), ("empty", "no bag in"), ("notes.txt", "notes.txt")],
)
def test_what_cannot_be_opened_is_told(page: Page, tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(UserError, match=words):
        enter(page, Path(name))


@pytest.mark.slow
def test_a_bag_is_mapped_by_clicks_and_the_result_opened(
    chromium: Any, bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def make(studio: Page) -> Any:
        return screen_for(studio, bag, load_config(None))()

    with running(make) as studio, opened(chromium, studio) as page:
        page.press("Map it")
        page.wait_for(lambda: np.any(page.pixels() < 60), "a wall on the map")
        page.wait_for(lambda: page.says("The map is"), "the verdict")
        page.press("Open the result")
        page.wait_for(lambda: page.says("About this run"), "the run")
        assert page.asked_hosts == {LOOPBACK}
