"""The room in which a run is looked at."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from viser import uplot

from racecar.maps.geometry.se2 import transform_points
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.runs.view.scene import Doubt, Scene
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.look.path_colors import PathColoring, path_colors, path_entry
from racecar.pipelines.studio.look.time_line import TimeLine
from racecar.pipelines.studio.map_image import known_extent, paint
from racecar.pipelines.studio.outlines import car_outline, cross, ellipse
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import CAR, LOOP, PARTICLE, PATH, SCAN, SKY, as_css, by_doubt, stops
from racecar.pipelines.studio.room import Room

_NEAR = 12.0
"""Metres that are seen from bottom to top where a doubtful stretch is looked at."""
_FRESH = 1_500_000_000
"""Nanoseconds for which a scan or a cloud of particles is shown: keyframes come once a second or so."""
_SIGMAS = 3.0
_PARTICLE_LENGTH = 0.12
"""Metres."""
_MOST_NAMED = 12
"""Doubtful stretches with a button of their own, so that the panel stays readable."""
_MISSED = 0.05
"""Metres by which the map misses a match that is drawn as the most doubtful: a cell, by judgement."""
_MARKER = 0.6
"""Metres: the cross over a doubtful place."""
_MOST_POINTS = 1500
"""Of a curve: a panel is some 300 pixels wide."""
_HEIGHT = 150
"""Pixels."""


class LookRoom(Room):
    """A run on the page."""

    def __init__(
        self,
        page: Page,
        scene: Scene,
        edit: Callable[[], None] | None = None,
        drive: Callable[[], None] | None = None,
    ) -> None:
        """``edit`` opens the room in which the map is edited, and ``drive`` the one in which a car drives on
        it; None where that cannot be."""
        self._page, self._scene, self._edit, self._drive = page, scene, edit, drive
        stamps = scene.trajectory.stamps
        self._start = int(stamps[0])
        self._coloring = PathColoring.TIME
        self._sight_stamps = np.array([sight.stamp for sight in scene.sights], dtype=np.int64)
        self._cloud_stamps = np.array([cloud.stamp for cloud in scene.clouds], dtype=np.int64)
        self._shown: int | None = None
        self._build_panel()
        low, high = _extent(scene)
        page.view.show_whole(low, high)

    def draw_all(self) -> None:
        """Draw map, path and what was found about them."""
        scene, layers = self._scene, self._page.layers
        layers.clear_all()
        if scene.grid is not None:
            layers.image("map", paint(scene.grid, self._page.ground))
        layers.segments("loops", scene.loops, LOOP, 2.0)
        layers.segments("matches", scene.matches, by_doubt(np.clip(scene.misses / _MISSED, 0.0, 1.0)), 2.0)
        layers.dots("keyframes", scene.keyframes, SKY, 6.0)
        places = [cross(doubt.place, _MARKER) for doubt in scene.doubts]
        layers.segments("mark", np.array(places).reshape(-1, 2, 2), LOOP, 4.0)
        self._draw_path()
        self._shown = None

    def step(self, seconds: float) -> None:
        """Let the time line go on."""
        self._time_line.pass_by(seconds)

    def draw(self) -> None:
        """Draw the moment, where it is another."""
        scan = self._scan_at(self._time_line.now)
        if scan != self._shown:
            self._shown = scan
            self._draw_moment(scan)

    def click(self, place: NDArray[np.float64]) -> None:
        """Go to the moment at which the car was nearest."""
        path = self._scene.trajectory.map_from_base[:, :2]
        nearest = int(np.argmin(np.linalg.norm(path - place, axis=1)))
        self._time_line.go_to(self._seconds_of(nearest))

    def _build_panel(self) -> None:
        page, scene = self._page, self._scene
        gui = page.gui
        with page.folder("Time"):
            last = self._seconds_of(len(scene.trajectory) - 1)
            self._time_line = TimeLine(page, last, self._seconds_after)
            self._moment = gui.add_markdown("")
        with page.folder("Show"):
            coloring = gui.add_dropdown(
                "Path by", [each.value for each in PathColoring], initial_value=self._coloring.value
            )
            page.on_change(coloring, self._color_path)
            for name, words, is_there, is_on in (
                ("scan", "Scan", bool(scene.sights), True),
                ("keyframes", "Keyframes", len(scene.keyframes) > 0, True),
                ("loops", "Loop closures", len(scene.loops) > 0, True),
                ("matches", "Matches of scans", len(scene.matches) > 0, False),
                ("particles", "Particles", bool(scene.clouds), True),
                ("ellipse", "Covariance (3 σ)", bool(np.any(scene.covariances)), True),
            ):
                if is_there:
                    self._add_switch(name, words, is_on=is_on)
        rooms = {"Edit the map": self._edit, "Drive on the map": self._drive}
        if any(rooms.values()):
            with page.folder("Map"):
                for label, enter in rooms.items():
                    if enter is not None:
                        page.on_press(gui.add_button(label), enter)
        with page.folder("Doubtful stretches"):
            self._list_doubts()
        add_plots(page, scene)
        with page.folder("About this run"):
            gui.add_markdown(scene.about)

    def _add_switch(self, name: str, words: str, *, is_on: bool) -> None:
        def show(is_wanted: bool) -> None:
            self._page.layers.show(name, is_wanted=is_wanted)
            self._draw_legend()

        self._page.on_change(self._page.gui.add_checkbox(words, is_on), show)
        self._page.layers.show(name, is_wanted=is_on)

    def _list_doubts(self) -> None:
        gui, doubts = self._page.gui, self._scene.doubts
        if not doubts:
            gui.add_markdown("None was found.")
        for number, doubt in enumerate(doubts[:_MOST_NAMED], start=1):
            button = gui.add_button(f"Go to {number}", color="orange")
            gui.add_markdown(literal(doubt.why))
            self._page.on_press(button, lambda doubt=doubt: self._go_to(doubt))  # type: ignore[misc]
        if len(doubts) > _MOST_NAMED:
            gui.add_markdown(f"And {len(doubts) - _MOST_NAMED} more, marked on the map.")

    def _go_to(self, doubt: Doubt) -> None:
        self._page.view.go_to(doubt.place, _NEAR)
        if doubt.seconds is not None:
            self._time_line.go_to(sum(doubt.seconds) / 2.0)

    def _color_path(self, value: str) -> None:
        self._coloring = PathColoring(value)
        self._draw_path()

    def _draw_path(self) -> None:
        scene = self._scene
        colors = path_colors(scene, self._coloring)
        each = colors[1:] if isinstance(colors, np.ndarray) else colors
        self._page.layers.line("path", scene.trajectory.map_from_base[:, :2], each, 3.0)
        self._draw_legend()

    def _draw_legend(self) -> None:
        scene = self._scene
        entries = [path_entry(self._coloring), Entry("car", [CAR])]
        for name, is_there, words, colors in (
            ("scan", scene.sights, "scan", [SCAN]),
            ("keyframes", len(scene.keyframes), "keyframe", [SKY]),
            ("loops", len(scene.loops), "loop closure", [LOOP]),
            (
                "matches",
                len(scene.matches),
                f"match, missed by up to {100 * _MISSED:.0f} cm",
                stops(by_doubt),
            ),
            ("particles", scene.clouds, "particle, with its heading", [PARTICLE]),
            ("mark", scene.doubts, "doubtful place (cross)", [LOOP]),
        ):
            if is_there and self._page.layers.is_shown(name):
                entries.append(Entry(words, colors))
        self._page.legend.show(entries)

    def _draw_moment(self, scan: int) -> None:
        scene, layers = self._scene, self._page.layers
        stamp, pose = int(scene.trajectory.stamps[scan]), scene.trajectory.map_from_base[scan]
        layers.line("car", car_outline(pose), CAR, 4.0)
        sight = _latest(self._sight_stamps, stamp)
        if sight is None:
            layers.clear("scan")
        else:
            taken_from = scene.trajectory.map_from_base[self._scan_of(int(self._sight_stamps[sight]))]
            points = scene.sights[sight].points_in_base.astype(np.float64)
            layers.dots("scan", transform_points(taken_from, points), SCAN, 3.0)
        cloud = _latest(self._cloud_stamps, stamp)
        if cloud is None:
            layers.clear("particles")
        else:
            layers.arrows("particles", scene.clouds[cloud].map_from_base, PARTICLE, _PARTICLE_LENGTH, 1.5)
        if np.any(scene.covariances):
            around = ellipse(pose[:2], scene.covariances[scan, :2, :2], _SIGMAS)
            layers.line("ellipse", around, PARTICLE, 2.0)
        self._moment.content = self._words(scan)

    def _words(self, scan: int) -> str:
        pose = self._scene.trajectory.map_from_base[scan]
        x, y = np.round(pose[:2], 2) + 0.0  # no "-0"
        words = f"x {x:.2f} m, y {y:.2f} m, heading {round(np.degrees(pose[2])):d}°"
        if np.any(self._scene.covariances):
            place, heading = self._scene.deviations[scan]
            words += f"; ± {100 * place:.1f} cm, ± {np.degrees(heading):.1f}°"
        return words

    def _scan_at(self, seconds: float) -> int:
        return self._scan_of(self._start + round(seconds * 1e9))

    def _scan_of(self, stamp: int) -> int:
        stamps = self._scene.trajectory.stamps
        return max(0, int(np.searchsorted(stamps, stamp, side="right")) - 1)

    def _seconds_of(self, scan: int) -> float:
        return float(self._scene.trajectory.stamps[scan] - self._start) * 1e-9

    def _seconds_after(self, scans: int) -> float:
        """So many scans after the one that is shown; a nanosecond more, as seconds are rounded."""
        last = len(self._scene.trajectory) - 1
        return self._seconds_of(min(max((self._shown or 0) + scans, 0), last)) + 1e-9


def _latest(stamps: NDArray[np.int64], stamp: int) -> int | None:
    """The last before a stamp, unless it is long past."""
    index = int(np.searchsorted(stamps, stamp, side="right")) - 1
    return index if index >= 0 and stamp - stamps[index] <= _FRESH else None


def _extent(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What is known of the map, and the path."""
    known = None if scene.grid is None else known_extent(scene.grid)
    places = np.vstack([scene.trajectory.map_from_base[:, :2], *(known or ())])
    return places.min(axis=0), places.max(axis=0)


def add_plots(page: Page, scene: Scene) -> None:
    """The standard deviations of place and heading, where the run has them."""
    if not np.any(scene.covariances):
        return
    every = -(-len(scene.trajectory) // _MOST_POINTS)
    seconds = (scene.trajectory.stamps[::every] - scene.trajectory.stamps[0]) * 1e-9
    deviations = scene.deviations[::every]
    with page.folder("Standard deviation", is_open=False):
        for words, values in (
            ("place (cm)", 100.0 * deviations[:, 0]),
            ("heading (°)", np.degrees(deviations[:, 1])),
        ):
            page.gui.add_uplot(
                (seconds, values),
                (uplot.Series(label="s"), uplot.Series(label=words, stroke=as_css(PATH), width=1)),
                title=words,
                scales={"x": uplot.Scale(time=False)},
                legend=uplot.Legend(show=False),
                height=_HEIGHT,
            )
