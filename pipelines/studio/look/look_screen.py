"""The screen for looking at a run, and at another one beside it."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.maps.errors import UserError
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.tone import TONE_OF_VERDICT, Tone
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.runs.view.headline import Headline
from racecar.pipelines.runs.view.measures import measures_of
from racecar.pipelines.runs.view.run_folder import load_run
from racecar.pipelines.runs.view.scene import Doubt, Scene
from racecar.pipelines.studio.look.shown_run import PathColor, ShownRun, extent_of
from racecar.pipelines.studio.look.time_line import TimeLine
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen, Tool

_NEAR = 12.0
"""Metres visible from bottom to top when looking at a doubtful segment."""
_MOST_NAMED = 12
"""Maximum doubtful segments with their own button, to keep the panel readable."""
_OF_DRIVES = {verdict.value for verdict in DriveVerdict}
_GAP = 0.08
"""Gap between two runs, as a share of the width of the first."""


class LookScreen(Screen):
    """A run on the page."""

    def __init__(
        self,
        page: Page,
        scene: Scene,
        edit: Callable[[], None] | None = None,
        mend: Callable[[], None] | None = None,
        drive: Callable[[], None] | None = None,
    ) -> None:
        """``edit`` opens the screen for editing the map, ``mend`` the one for correcting it by hand,
        ``drive`` the one for driving on it; None if that is impossible."""
        self._page, self._scene = page, scene
        self._seconds = scene.seconds
        self._runs = [ShownRun(scene, page.layers, np.zeros(2))]
        self._go_to_place = Tool("Go through time", "Click the path.", self._go_to_nearest)
        self._build_panel({"Edit the map": edit, "Correct the map by hand": mend, "Drive on the map": drive})
        self._show_verdict()
        page.view.show_whole(*self._runs[0].extent)

    @property
    def tool(self) -> Tool:
        """Clicks go to the time when the car was nearest."""
        return self._go_to_place

    def step(self, seconds: float) -> None:
        """Advance the time line."""
        self._time_line.pass_by(seconds)

    def draw(self) -> bool:
        """Draw the current time, if it changed."""
        first, now = self._runs[0], self._time_line.now
        have_changed = [run.draw(run.stamp_at(now, first)) for run in self._runs]
        if any(have_changed):
            self._time_line.draw(" &emsp;|&emsp; ".join(run.words() for run in self._runs))
        return any(have_changed)

    def show_beside(self, other: Scene) -> None:
        """Show another run to the right of this one: at the same moments if both are of one time, or else as
        long after its start."""
        low, high = self._runs[0].extent
        offset = np.array([high[0] + _GAP * (high[0] - low[0]) - extent_of(other)[0][0], 0.0])
        run = ShownRun(other, self._page.layers_beside(offset), offset)
        self._runs = [self._runs[0], run]
        for name, switch in self._switches.items():
            run.show(name, is_wanted=switch.value)
        corners = np.array([low, high, *run.extent])
        self._page.view.show_whole(corners.min(axis=0), corners.max(axis=0))
        self._time_line.compare(measures_of(other))

    def _show_verdict(self) -> None:
        """The verdict as a headline, with its reasons."""
        scene = self._scene
        if scene.verdict:
            whys = [*scene.reasons, *(doubt.why for doubt in scene.doubts[:_MOST_NAMED])]
            tone = TONE_OF_VERDICT.get(scene.verdict, Tone.NEUTRAL)
            head = f"The {'drive' if scene.verdict in _OF_DRIVES else 'map'} is {scene.verdict}"
            self._page.frame.head(Headline(head, tone, scene.expected, tuple(dict.fromkeys(whys))))

    def _build_panel(self, elsewhere: dict[str, Callable[[], None] | None]) -> None:
        page, gui, scene = self._page, self._page.gui, self._scene
        spans = [doubt.seconds for doubt in scene.doubts if doubt.seconds is not None]
        self._measures = measures_of(scene)
        self._time_line = TimeLine(
            page, self._seconds[-1], self._seconds_after, self._measures, spans, self._go_to_worst
        )
        with page.folder("Show"):
            self._add_switches()
        if any(elsewhere.values()):
            with page.folder("Map"):
                for label, enter in elsewhere.items():
                    if enter is not None:
                        page.on_press(gui.add_button(label), enter)
        with page.folder("Doubtful stretches"):
            self._list_doubts()
        with page.folder("Another run beside it", is_open=False):
            path = gui.add_text("Folder", "", hint="Such as the run before an edit, or its localization.")
            page.on_press(
                gui.add_button("Show beside"), lambda: self.show_beside(load_run(typed_path(path.value)))
            )
        with page.folder("About this run"):
            gui.add_markdown(scene.about)

    def _add_switches(self) -> None:
        """Switches of what the run holds, and a sentence about what it does not."""
        page, gui, scene = self._page, self._page.gui, self._scene
        colors = gui.add_dropdown(
            "Path by", [each.value for each in PathColor], initial_value=PathColor.TIME.value
        )
        page.on_change(colors, self._color_paths)
        self._switches = {}
        absent = []
        for name, words, is_there in (
            ("floor_plan", "Floor plan", scene.floor_plan is not None),
            ("scan", "Scan", bool(scene.sights)),
            ("keyframes", "Keyframes", len(scene.keyframes) > 0),
            ("loops", "Loop closures", len(scene.loops) > 0),
            ("matches", "Scan matches", len(scene.matches) > 0),
            ("particles", "Particles", bool(scene.clouds)),
            ("ellipse", "Covariance (3 σ)", self._runs[0].has_covariances),
        ):
            if not is_there:
                absent.append(words.lower())
                continue
            self._switches[name] = switch = gui.add_checkbox(words, name not in ("matches", "keyframes"))
            page.on_change(switch, partial(self._show, name))
            self._show(name, switch.value)
        if absent:
            gui.add_markdown(
                f"Not in this run: {', '.join(absent)}. Scans, particles and covariances of a localization "
                "are written with --record."
            )

    def _color_paths(self, color: str) -> None:
        for run in self._runs:
            run.draw_path(PathColor(color))

    def _show(self, name: str, is_wanted: bool) -> None:
        for run in self._runs:
            run.show(name, is_wanted=is_wanted)

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
        run = self._runs[0]
        scan = run.scan_of(run.stamp_at(self._time_line.now))
        self._page.view.go_to(self._scene.trajectory.map_from_base[scan, :2], _NEAR)

    def _go_to(self, doubt: Doubt) -> None:
        self._page.view.go_to(doubt.place, _NEAR)
        if doubt.seconds is not None:
            self._time_line.go_to(sum(doubt.seconds) / 2.0)

    def _go_to_nearest(self, place: NDArray[np.float64]) -> None:
        self._time_line.go_to(min(run.nearest(place) for run in self._runs)[1])

    def _seconds_after(self, scans: int) -> float:
        """Time of the scan this many after the current one; plus 1 ns, as seconds are rounded."""
        run = self._runs[0]
        number = run.scan_of(run.stamp_at(self._time_line.now)) + scans
        return float(self._seconds[min(max(number, 0), len(self._seconds) - 1)]) + 1e-9
