"""The map of a run is edited on the page, by clicks in a browser."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.files.edits_file import edits_beside
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.studio import screen_for
from tests.pipelines.studio.chromium import Opened, opened, running

AREA = [(5.0, -0.5), (6.0, -0.5), (6.0, 0.5), (5.0, 0.5)]
BOW_TIE = [(5.0, -0.5), (6.0, 0.5), (6.0, -0.5), (5.0, 0.5)]


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of some metres along the x axis."""
    folder = tmp_path_factory.mktemp("drive")
    bag = folder / "drive.bag"
    assert run(["simulate", "--map", "track", "--out", str(bag), "--duration", "4", "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(folder / "map"), "--quiet"]) == 0
    return folder / "map"


@pytest.fixture
def folder(mapped: Path, tmp_path: Path) -> Path:
    """A copy of that run, with edits of a person beside it."""
    shutil.copytree(mapped, tmp_path / "map")
    (tmp_path / "map/edits.yaml").write_text(
        "# by hand\n- unknown: [[3, -0.5], [4, -0.5], [4, 0.5]]  # a chair\n"
    )
    return tmp_path / "map"


@pytest.fixture
def page(chromium: Any, folder: Path) -> Iterator[Opened]:
    def make(studio: Page) -> Any:
        return screen_for(studio, folder, load_config(None))()

    with running(make) as studio, opened(chromium, studio) as page:
        page.press("Edit the map")
        page.wait_for(lambda: page.says("Save and render"), "the screen on which one edits")
        page.wait_for(lambda: in_list(page, "1: unknown, 3 corners"), "the edits that are there")
        yield page


def in_list(page: Opened, name: str) -> bool:
    """Whether the list of edits shows a name as chosen."""
    return bool(page.list_of("Chosen").input_value() == name)


def draw(page: Opened, corners: list[tuple[float, float]]) -> None:
    for corner in corners:
        page.click(corner)


def value_at(map: Path, x: float, y: float) -> int:
    grid = load_map(map)
    row, column = grid.cell_of([[x, y]])[0]
    return int(grid.cells[row, column])


@pytest.mark.slow
def test_an_area_is_drawn_by_clicks_and_saved_with_those_of_a_person(page: Opened, folder: Path) -> None:
    assert value_at(folder, 5.5, 0.0) == 0
    page.choose("Kind", "Unknown")
    draw(page, [*AREA, AREA[0]])
    page.wait_for(lambda: in_list(page, "2: unknown, 4 corners"), "the area to be finished")
    page.choose("Kind", "Keep out")
    draw(page, AREA)
    page.press("Finish the shape")
    page.wait_for(lambda: in_list(page, "3: keep out, 4 corners"), "the second area")
    page.press("Save and render")
    page.wait_for(lambda: page.says("was rendered into"), "the map to be saved")
    assert (folder / "edits.yaml").read_text().startswith("# by hand\n- unknown: [[3, -0.5]")
    edits = edits_beside(folder).edits
    assert [edit.kind for edit in edits] == ["unknown", "unknown", "keepout"]
    np.testing.assert_allclose(edits[1].points, AREA, atol=0.05)
    assert value_at(folder, 5.5, 0.0) == -1
    assert value_at(folder / "keepout_mask.yaml", 5.5, 0.0) == 100
    assert page.asked_hosts == {LOOPBACK}
    page.press("Back to the run")
    page.wait_for(lambda: page.says("About this run"), "the run again")


@pytest.mark.slow
def test_mistakes_are_told_steps_undone_and_all_pages_see_the_same(
    page: Opened, folder: Path, chromium: Any
) -> None:
    page.choose("Kind", "Free")
    draw(page, BOW_TIE)
    page.press("Finish the shape")
    page.wait_for(lambda: page.says("crosses itself near"), "the mistake to be told")
    page.wait_for(lambda: page.says("Not finished. What was drawn"), "the same in the panel")
    page.press("Save and render")
    page.wait_for(lambda: page.says("A shape is not finished"), "the unfinished shape to be told")
    for _ in BOW_TIE[1:]:
        page.press("Undo")
    page.wait_for(lambda: not page.says("Not finished."), "the reason to go with the corners")
    page.wait_for(lambda: not page.says("Not possible"), "the messages over the map to go")
    draw(page, [*AREA[1:], AREA[0]])
    page.wait_for(lambda: in_list(page, "2: free, 4 corners"), "the shape without its mistake")
    with opened(chromium, page.studio) as second:
        assert in_list(second, "2: free, 4 corners")
        second.press("Remove the chosen one")
        page.wait_for(lambda: in_list(page, "1: unknown, 3 corners"), "the removal on the first page")
    page.press("Remove the chosen one")
    page.wait_for(lambda: in_list(page, "none yet"), "no edits")
    page.press("Back to the run")
    page.wait_for(lambda: page.says("is not saved"), "a warning")
    page.press("Save and render")
    page.wait_for(lambda: page.says("was rendered into"), "the map to be saved")
    assert edits_beside(folder).edits == ()


@pytest.mark.slow
def test_no_click_is_lost_while_the_page_is_busy(page: Opened) -> None:
    draft = page.studio._screen._draft  # type: ignore[union-attr]
    page.tab.evaluate(
        "() => { setTimeout(() => { const end = Date.now() + 2000; while (Date.now() < end); }) }"
    )
    for corner in AREA:
        page.click(corner)
    page.wait_for(lambda: len(draft.corners) == len(AREA), "all corners", lambda: str(draft.corners))
    np.testing.assert_allclose(draft.corners, AREA, atol=0.05)
    page.tab.evaluate(
        "() => { for (const button of document.querySelectorAll('button'))"
        " if (button.textContent.trim() === 'Undo') for (let n = 0; n < 3; n++) button.click(); }"
    )
    page.wait_for(lambda: len(draft.corners) == len(AREA) - 3, "each press", lambda: str(draft.corners))


@pytest.mark.slow
def test_a_corner_is_dragged_and_a_wall_closed(page: Opened, folder: Path) -> None:
    page.choose("Kind", "Wall")
    draw(page, [*AREA, AREA[0]])
    page.press("Finish the shape")
    page.wait_for(lambda: in_list(page, "2: wall, 5 corners"), "the wall")
    page.press("Change the chosen one")
    page.wait_for(lambda: in_list(page, "1: unknown, 3 corners"), "the wall to be drawn on")
    page.drag(AREA[1], (6.5, -0.5))
    page.press("Finish the shape")
    page.wait_for(lambda: in_list(page, "2: wall, 5 corners"), "the wall again")
    page.press("Save and render")
    page.wait_for(lambda: page.says("was rendered into"), "the map to be saved")
    wall = edits_beside(folder).edits[1].points
    np.testing.assert_array_equal(wall[0], wall[-1])
    np.testing.assert_allclose(wall[1], [6.5, -0.5], atol=0.05)
