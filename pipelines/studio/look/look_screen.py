"""The screen for looking at a run."""

from collections.abc import Callable
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import transform_points
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.runs.view.headline import Headline, Tone
from racecar.pipelines.runs.view.measures import measures_of
from racecar.pipelines.runs.view.scene import Doubt, Scene
from racecar.pipelines.studio.look.time_line import TimeLine
from racecar.pipelines.studio.map_image import known_extent
from racecar.pipelines.studio.outlines import cross
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import BY_DOUBT, BY_TIME, Shades
from racecar.pipelines.studio.screen import Screen, Tool
from racecar.pipelines.studio.watched_car import Glimpse

_NEAR = 12.0
"""Metres visible from bottom to top when looking at a doubtful segment."""
_FRESH = 1_500_000_000
"""Nanoseconds for which a scan or a particle cloud is shown; keyframes are about a second apart."""
_MOST_NAMED = 12
"""Maximum doubtful segments with their own button, to keep the panel readable."""
_MISSED = 0.05
"""Residual in metres at which a match is drawn as most doubtful. Chosen by judgement: a cell."""
_DOUBTFUL_DEVIATION = 0.3
"""Standard deviation in metres of the position that is painted as most doubtful: about the car's width."""
_OF_DRIVES = {"localized": Tone.GOOD, "uncertain": Tone.DOUBTFUL, "lost": Tone.BAD}
_TONES = {"good": Tone.GOOD, "doubtful": Tone.DOUBTFUL, "wrong": Tone.BAD, **_OF_DRIVES}
"""Colours of the verdicts on a map, and on a drive."""
_MARKER = 0.6
"""Size in metres of the cross at a doubtful place."""


class _PathColor(str, Enum):
    """What the path's colour shows."""

    PLAIN = "one colour"
    TIME = "time"
    DOUBT = "doubt"


class LookScreen(Screen):
    """A run on the page."""

    def __init__(
        self,
        page: Page,
        scene: Scene,
        edit: Callable[[], None] | None = None,
        drive: Callable[[], None] | None = None,
    ) -> None:
        """``edit`` opens the screen for editing the map, ``drive`` the one for driving on it; None if that is
        impossible."""
        self._page, self._scene = page, scene
        self._seconds = scene.seconds
        self._has_covariances = bool(np.any(scene.covariances))
        self._sight_stamps = np.array([sight.stamp for sight in scene.sights], dtype=np.int64)
        self._cloud_stamps = np.array([cloud.stamp for cloud in scene.clouds], dtype=np.int64)
        self._shown: int | None = None
        self._go_to_place = Tool("Go through time", "Click the path.", self._go_to_nearest)
        self._build_panel({"Edit the map": edit, "Drive on the map": drive})
        self._show_verdict()
        self._draw_run()
        page.view.show_whole(*_extent(scene))

    @property
    def tool(self) -> Tool:
        """Clicks go to the time when the car was nearest."""
        return self._go_to_place

    def step(self, seconds: float) -> None:
        """Advance the time line."""
        self._time_line.pass_by(seconds)

    def draw(self) -> bool:
        """Draw the current time, if it changed."""
        scan = self._scan_at(self._time_line.now)
        if scan == self._shown:
            return False
        self._shown = scan
        self._glimpse(scan).draw(self._page.layers)
        self._time_line.draw(self._words(scan))
        return True

    def _show_verdict(self) -> None:
        """The verdict as a headline, with its reasons."""
        scene = self._scene
        if scene.verdict:
            whys = [*scene.reasons, *(doubt.why for doubt in scene.doubts[:_MOST_NAMED])]
            tone = _TONES.get(scene.verdict, Tone.NEUTRAL)
            head = f"The {'drive' if scene.verdict in _OF_DRIVES else 'map'} is {scene.verdict}"
            self._page.frame.head(Headline(head, tone, scene.expected, tuple(dict.fromkeys(whys))))

    def _draw_run(self) -> None:
        """Draw the map, the path and the findings about them."""
        scene, layers = self._scene, self._page.layers
        if scene.grid is not None:
            layers.map(scene.grid)
        layers.segments("loops", scene.loops)
        missed = np.clip(scene.misses / _MISSED, 0.0, 1.0)
        words = f"match, missed by up to {100 * _MISSED:.0f} cm"
        layers.segments("matches", scene.matches, Shades(words, BY_DOUBT, missed))
        layers.dots("keyframes", scene.keyframes)
        places = [cross(doubt.place, _MARKER) for doubt in scene.doubts]
        layers.segments("doubts", np.array(places).reshape(-1, 2, 2))
        self._draw_path(_PathColor.TIME)

    def _build_panel(self, elsewhere: dict[str, Callable[[], None] | None]) -> None:
        page, gui, scene = self._page, self._page.gui, self._scene
        spans = [doubt.seconds for doubt in scene.doubts if doubt.seconds is not None]
        self._measures = measures_of(scene)
        self._time_line = TimeLine(
            page, self._seconds[-1], self._seconds_after, self._measures, spans, self._go_to_worst
        )
        with page.folder("Show"):
            colors = gui.add_dropdown(
                "Path by", [each.value for each in _PathColor], initial_value=_PathColor.TIME.value
            )
            page.on_change(colors, lambda color: self._draw_path(_PathColor(color)))
            for name, words, is_there in (
                ("scan", "Scan", bool(scene.sights)),
                ("keyframes", "Keyframes", len(scene.keyframes) > 0),
                ("loops", "Loop closures", len(scene.loops) > 0),
                ("matches", "Matches of scans", len(scene.matches) > 0),
                ("particles", "Particles", bool(scene.clouds)),
                ("ellipse", "Covariance (3 σ)", self._has_covariances),
            ):
                if is_there:
                    self._add_switch(name, words, is_on=name not in ("matches", "keyframes"))
        if any(elsewhere.values()):
            with page.folder("Map"):
                for label, enter in elsewhere.items():
                    if enter is not None:
                        page.on_press(gui.add_button(label), enter)
        with page.folder("Doubtful stretches"):
            self._list_doubts()
        with page.folder("About this run"):
            gui.add_markdown(scene.about)

    def _add_switch(self, name: str, words: str, *, is_on: bool) -> None:
        layers = self._page.layers
        switch = self._page.gui.add_checkbox(words, is_on)
        self._page.on_change(switch, lambda is_wanted: layers.show(name, is_wanted=is_wanted))
        layers.show(name, is_wanted=is_on)

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

    def _go_to_worst(self) -> None:
        """The first stretch that the verdict names in this drive, or else where fit or certainty is least."""
        named = [doubt for doubt in self._scene.doubts if doubt.seconds is not None]
        if named:
            self._go_to(named[0])
            return
        judged = [measure for measure in self._measures if measure.name != "speed"]
        if not judged:
            raise UserError("This run holds neither scans nor certainties to compare moments by.")
        worst = judged[-1]
        self._time_line.go_to(float(worst.seconds[worst.worst]))
        scan = self._scan_at(self._time_line.now)
        self._page.view.go_to(self._scene.trajectory.map_from_base[scan, :2], _NEAR)

    def _go_to(self, doubt: Doubt) -> None:
        self._page.view.go_to(doubt.place, _NEAR)
        if doubt.seconds is not None:
            self._time_line.go_to(sum(doubt.seconds) / 2.0)

    def _go_to_nearest(self, place: NDArray[np.float64]) -> None:
        path = self._scene.trajectory.map_from_base[:, :2]
        self._time_line.go_to(self._seconds[np.argmin(np.linalg.norm(path - place, axis=1))])

    def _draw_path(self, color: _PathColor) -> None:
        shades = None
        if color == _PathColor.TIME:
            shades = Shades("path, early to late", BY_TIME, np.linspace(0.0, 1.0, len(self._seconds))[1:])
        elif color == _PathColor.DOUBT:
            shades = Shades("path, sure to doubtful", BY_DOUBT, self._path_doubts()[1:])
        self._page.layers.line("path", self._scene.trajectory.map_from_base[:, :2], shades)

    def _path_doubts(self) -> NDArray[np.float64]:
        """(S,) 0 to 1: the relative uncertainty of the estimate, and 1 in segments that the verdict names."""
        doubts = np.zeros(len(self._seconds))
        if self._has_covariances:
            doubts = np.minimum(self._scene.deviations[:, 0] / _DOUBTFUL_DEVIATION, 1.0)
        for doubt in self._scene.doubts:
            if doubt.seconds is not None:
                first, last = doubt.seconds
                doubts[(self._seconds >= first) & (self._seconds <= last)] = 1.0
        return doubts

    def _glimpse(self, scan: int) -> Glimpse:
        """The car at a scan, with what was recorded shortly before."""
        scene, trajectory = self._scene, self._scene.trajectory
        stamp, pose = int(trajectory.stamps[scan]), trajectory.map_from_base[scan]
        sight, cloud = _latest(self._sight_stamps, stamp), _latest(self._cloud_stamps, stamp)
        points = np.zeros((0, 2))
        if sight is not None:
            taken_from = trajectory.map_from_base[self._scan_of(scene.sights[sight].stamp)]
            points = transform_points(taken_from, scene.sights[sight].points_in_base)
        return Glimpse(
            pose,
            points,
            particles=None if cloud is None else scene.clouds[cloud].map_from_base,
            covariance=scene.covariances[scan] if self._has_covariances else None,
        )

    def _words(self, scan: int) -> str:
        pose = self._scene.trajectory.map_from_base[scan]
        x, y = np.round(pose[:2], 2) + 0.0  # no "-0"
        words = f"x {x:.2f} m, y {y:.2f} m, heading {round(np.degrees(pose[2])):d}°"
        if self._has_covariances:
            place, heading = self._scene.deviations[scan]
            words += f"; ± {100 * place:.1f} cm, ± {np.degrees(heading):.1f}°"
        return words

    def _scan_at(self, seconds: float) -> int:
        return self._scan_of(int(self._scene.trajectory.stamps[0]) + round(seconds * 1e9))

    def _scan_of(self, stamp: int) -> int:
        stamps = self._scene.trajectory.stamps
        return max(0, int(np.searchsorted(stamps, stamp, side="right")) - 1)

    def _seconds_after(self, scans: int) -> float:
        """Time of the scan this many after the current one; plus 1 ns, as seconds are rounded."""
        number = min(max((self._shown or 0) + scans, 0), len(self._seconds) - 1)
        return float(self._seconds[number]) + 1e-9


def _latest(stamps: NDArray[np.int64], stamp: int) -> int | None:
    """Index of the last stamp before this one, unless that is long past."""
    index = int(np.searchsorted(stamps, stamp, side="right")) - 1
    return index if index >= 0 and stamp - stamps[index] <= _FRESH else None


def _extent(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Extent of the known map and the path."""
    known = None if scene.grid is None else known_extent(scene.grid)
    places = np.vstack([scene.trajectory.map_from_base[:, :2], *(known or ())])
    return places.min(axis=0), places.max(axis=0)
