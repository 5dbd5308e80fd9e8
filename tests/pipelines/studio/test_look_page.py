"""A run on the page, as a person sees and uses it in a browser."""

from contextlib import closing
from typing import Any

import numpy as np
import pytest

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.view.scene import Doubt, ParticleCloud, Scene, Sight
from racecar.pipelines.studio.look.look_screen import LookScreen
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK
from tests.pipelines.studio.chromium import WIDTH, opened, running

SCANS = 41


def a_run() -> Scene:
    """A drive of 4 s and 4 m to the right through a room of 8 x 6 m."""
    cells = np.full((120, 160), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    stamps = 10**9 + np.arange(SCANS) * 10**8
    poses = np.column_stack([np.linspace(2.0, 6.0, SCANS), np.full(SCANS, 3.0), np.zeros(SCANS)])
    wall = np.column_stack([np.full(50, 1.0), np.linspace(-1.0, 1.0, 50)]).astype(np.float32)
    return Scene(
        "a run",
        "It was made up.",
        Trajectory(stamps, poses),
        OccupancyGrid(cells, 0.05, np.zeros(3)),
        sights=[Sight(int(stamp), wall) for stamp in stamps],
        clouds=[ParticleCloud(int(stamp), pose[None]) for stamp, pose in zip(stamps, poses, strict=True)],
        covariances=np.tile(np.diag([0.01, 0.01, 0.001]), (SCANS, 1, 1)),
        doubts=[Doubt("Here it is doubtful.", np.array([5.0, 3.0]), (2.9, 3.1))],
    )


def test_a_run_is_gone_through_by_clicks(chromium: Any) -> None:
    with running(lambda studio: LookScreen(studio, a_run())) as studio, opened(chromium, studio) as page:
        page.wait_for(lambda: page.says("x 2.00 m"), "the first scan")
        page.wait_for(lambda: np.any(page.pixels() < 60), "a wall on the map")
        page.press("scan ▶")
        page.wait_for(lambda: page.says("x 2.10 m"), "the next scan")
        page.click((4.0, 3.5))
        page.wait_for(lambda: page.says("x 4.00 m"), "the moment of the clicked place")
        page.press("Go to 1")
        page.wait_for(lambda: page.says("x 5.00 m"), "the doubtful stretch")
        page.tab.keyboard.press("Home")
        page.wait_for(lambda: page.says("x 2.00 m"), "the start")
        page.tab.keyboard.press("ArrowRight")
        page.wait_for(lambda: page.says("x 2.10 m"), "the next scan, by a key")
        page.tab.keyboard.press("w")
        page.wait_for(lambda: page.says("x 5.00 m"), "the worst moment")
        bar = page.tab.get_by_test_id("lanes").bounding_box()
        assert bar["width"] > 0.9 * WIDTH
        page.tab.mouse.click(bar["x"] + bar["width"] / 2.0, bar["y"] + bar["height"] / 2.0)
        page.wait_for(lambda: page.says("x 4.00 m"), "the moment that is clicked in the time bar")
        page.tab.keyboard.press(" ")
        page.wait_for(lambda: page.says("x 6.00 m"), "the end of the drive")
        assert page.asked_hosts == {LOOPBACK}


def beside(scene: Scene, other: Scene, seconds: float) -> tuple[LookScreen, list[str]]:
    """A screen that shows both at a moment, and what it says about them."""
    with closing(Page("two runs", 0)) as page:
        page.enter(lambda: LookScreen(page, scene))
        screen = page._screen
        assert isinstance(screen, LookScreen)
        screen.show_beside(other)
        screen._time_line.go_to(seconds)
        screen.draw()
        return screen, [run.words() for run in screen._runs]


@pytest.mark.parametrize(("later", "x"), [(0, "x 4.00 m"), (10**9, "x 3.00 m"), (10**12, "x 4.00 m")])
def test_two_runs_are_shown_at_one_moment_or_as_long_after_their_starts(later: int, x: str) -> None:
    other = a_run()
    other.trajectory = Trajectory(other.trajectory.stamps + later, other.trajectory.map_from_base)
    screen, (first, second) = beside(a_run(), other, 2.0)
    assert first.startswith("x 4.00 m")
    assert second.startswith(x)
    assert screen._runs[1].extent[0][0] > screen._runs[0].extent[1][0]


def test_a_click_on_the_other_run_goes_to_its_moment() -> None:
    screen, _ = beside(a_run(), a_run(), 0.0)
    left = screen._runs[1].extent[0]
    screen.tool.click(left + np.array([5.0, 3.0]))
    assert screen._time_line.now == pytest.approx(3.0)


def test_what_a_run_does_not_hold_is_told_instead_of_a_switch_that_does_nothing() -> None:
    bare = a_run()
    bare.clouds, bare.sights = [], bare.sights[:1]
    screen, (first, _) = beside(bare, bare, 3.9)
    assert set(screen._switches) == {"scan", "ellipse"}
    assert first.endswith("no scan was recorded here")


def test_a_floor_plan_is_drawn_where_it_lies() -> None:
    scene = a_run()
    lines = np.zeros((3, 3), dtype=np.int8)
    lines[1, 2] = OCCUPIED
    scene.floor_plan = OccupancyGrid(lines, 0.5, np.array([1.0, 2.0, np.pi / 2]))
    with closing(Page("a plan", 0)) as page:
        page.enter(lambda: LookScreen(page, scene))
        np.testing.assert_allclose(page.layers._handles["floor_plan"].points[:, :2], [[0.25, 3.25]])


@pytest.mark.slow
def test_the_map_is_dragged_and_zoomed_and_stays_upright(chromium: Any) -> None:
    with running(lambda studio: LookScreen(studio, a_run())) as studio, opened(chromium, studio) as page:
        camera = next(iter(studio.server.get_clients().values())).camera
        before = camera.position.copy()
        page.drag((3.0, 4.0), (4.0, 3.5))
        page.wait_for(lambda: np.allclose(camera.position[:2], before[:2] - [1.0, -0.5], atol=0.05), "a move")
        page.tab.mouse.wheel(0, -300)
        page.wait_for(lambda: camera.position[2] < 0.9 * before[2], "a nearer view")
        page.tab.keyboard.down("ArrowUp")
        page.tab.wait_for_timeout(300)
        page.tab.keyboard.up("ArrowUp")
        page.wait_for(
            lambda: np.allclose(camera.look_at[:2], camera.position[:2], atol=0.01), "straight down again"
        )


@pytest.mark.slow
def test_a_second_page_and_a_page_that_comes_back_show_the_same_moment(chromium: Any) -> None:
    with running(lambda studio: LookScreen(studio, a_run())) as studio:
        with opened(chromium, studio) as first, opened(chromium, studio) as second:
            first.press("scan ▶")
            second.wait_for(lambda: second.says("x 2.10 m"), "the same scan on both pages")
        with opened(chromium, studio) as third:
            third.wait_for(lambda: third.says("x 2.10 m"), "the same scan again")


@pytest.mark.slow
def test_the_verdict_is_a_headline_that_unfolds_its_reasons(chromium: Any) -> None:
    scene = a_run()
    scene.verdict, scene.reasons, scene.expected = "doubtful", ("Two passes disagree.",), "expect 5 cm"
    with running(lambda studio: LookScreen(studio, scene)) as studio, opened(chromium, studio) as page:
        page.wait_for(lambda: page.says("The map is doubtful"), "the verdict")
        assert page.says("expect 5 cm")
        reason = page.tab.get_by_text("Two passes disagree.")
        assert not reason.is_visible()
        page.tab.get_by_text("The map is doubtful").click()
        page.wait_for(reason.is_visible, "its reasons")
        assert page.tab.get_by_text("Here it is doubtful.").first.is_visible()
