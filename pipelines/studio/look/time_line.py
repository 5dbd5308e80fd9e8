"""The time bar along the bottom of the page: curves that are clicked and dragged on, playback, and keys."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from racecar.pipelines.runs.view.measures import Measure
from racecar.pipelines.studio.look.lanes import lanes
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import LOOP, STRIP, as_css

_SPEEDS = {"½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0, "20 ×": 20.0}
_LEAST_SECONDS = 0.1
"""Minimum length of the slider, whose two ends must differ."""
_LEAP = 5.0
"""Seconds of an arrow with shift, as in players of films."""
_CONTROLS, _LANE = 42, 30
"""Pixels: height of the buttons and of each curve."""
_SLIDER_STEPS = 10_000
"""Places of the slider: more than a screen has pixels."""
_FOLDER = ".mantine-Paper-root:has(> div > div > div > div > .time-bar)"
"""The section of the side panel that becomes the bar."""
_STYLE = f"""<style>
{_FOLDER} {{ position: fixed; left: 0; right: 0; bottom: {STRIP}px; height: var(--bar); z-index: 6;
  margin: 0 !important; padding: 0; border-width: 1px 0 0; border-radius: 0; box-sizing: border-box;
  background: var(--mantine-color-body); }}
{_FOLDER} > .mantine-Paper-root {{ display: none; }}
{_FOLDER} > div > div > div {{ display: flex; align-items: center; gap: 4px; padding: 0 14px !important;
  height: {_CONTROLS}px; }}
{_FOLDER} > div > div, {_FOLDER} > div > div > div > div {{ padding: 0 !important; }}
{_FOLDER} > div > div > div > div:has(.moment) {{ flex-grow: 1; }}
{_FOLDER} .mantine-Button-root {{ width: auto; padding: 0 14px; }}
{_FOLDER} div:has(> p > label) {{ display: none; }}
{_FOLDER} .mantine-Select-root {{ width: 76px; }}
{_FOLDER} .mantine-NumberInput-root {{ display: none; }}
.lanes, {_FOLDER} div:has(> .mantine-Slider-root) {{ position: absolute !important; left: 14px; right: 14px;
  top: {_CONTROLS}px; bottom: 18px; }}
.lanes svg {{ width: 100%; height: 100%; display: block; }}
.lanes span {{ position: absolute; font: 12px/1.2 sans-serif; pointer-events: none; }}
.lanes .name {{ left: 2px; font-weight: bold; background: var(--mantine-color-body); opacity: 0.85;
  padding: 0 4px; border-left: 6px solid; }}
.lanes .tick {{ bottom: -16px; transform: translateX(-50%); opacity: 0.8; }}
{_FOLDER} .mantine-Slider-root {{ position: absolute; inset: 0; height: 100% !important;
  padding: 0 !important; cursor: pointer; }}
{_FOLDER} .mantine-Slider-trackContainer, {_FOLDER} .mantine-Slider-track {{ height: 100%; }}
{_FOLDER} .mantine-Slider-track::before, {_FOLDER} .mantine-Slider-markWrapper {{ display: none; }}
{_FOLDER} .mantine-Slider-bar {{ background: none; border-radius: 0; border-right: 3px solid {as_css(LOOP)};
  height: 100%; }}
{_FOLDER} .mantine-Slider-thumb {{ visibility: hidden; }}
.moment {{ font: 14px/1.2 sans-serif; text-align: right; }}
</style>"""
_ARROWS_ARE_OURS = (
    '<img hidden src="data:," onerror="window.racecarKeys ||= (document.documentElement.addEventListener('
    "'keydown', event => event.key.startsWith('Arrow') && event.stopPropagation()), true)\">"
)
"""Keeps the arrow keys, which would tilt the view, from the page's camera. A script in HTML is not run,
but the handler of a picture that is none."""


class TimeLine:
    """Seconds since the start of a drive, and playback."""

    def __init__(
        self,
        page: Page,
        seconds: float,
        step: Callable[[int], float],
        measures: Sequence[Measure],
        spans: Sequence[tuple[float, float]],
        worst: Callable[[], None],
    ) -> None:
        """``step`` returns the time that many scans later, or earlier if negative; ``worst`` goes to the
        worst moment. ``spans`` are doubtful seconds."""
        self.end = max(seconds, _LEAST_SECONDS)
        self._measures, self._spans = measures, spans
        self._step, self._is_playing = step, False
        self.now = 0.0
        gui = page.gui
        with page.folder("Time"):
            height = _CONTROLS + _LANE * len(measures) + 22
            style = f"<style>:root {{ --bar: {height}px; }}</style>{_STYLE}{_ARROWS_ARE_OURS}"
            gui.add_html(f'<span class="time-bar"></span>{style}')
            self._lanes = gui.add_html("")
            self._slider: Any = gui.add_slider("Seconds", 0.0, self.end, self.end / _SLIDER_STEPS, 0.0)
            self._play = gui.add_button("Play", hint="Space")
            before = gui.add_button("◀ scan", hint="A scan back: arrow left; with shift 5 s.", color="gray")
            after = gui.add_button("scan ▶", hint="A scan on: arrow right; with shift 5 s.", color="gray")
            self._speed = gui.add_dropdown("Speed", list(_SPEEDS), initial_value="1 ×")
            worst_button = gui.add_button("Worst moment", hint="W", color="orange")
            self._moment = gui.add_html("")
        self.compare([])
        page.on_change(self._slider, self._take)
        page.on_press(self._play, self.toggle)
        page.on_press(before, lambda: self.go_to(self._step(-1)))
        page.on_press(after, lambda: self.go_to(self._step(1)))
        page.on_press(worst_button, worst)
        page.on_key("space", self.toggle, "Play or pause")
        page.on_key("arrowleft", lambda: self.go_to(self._step(-1)), "A scan back")
        page.on_key("arrowright", lambda: self.go_to(self._step(1)), "A scan on")
        page.on_key("arrowleft", lambda: self.go_to(self.now - _LEAP), "5 s back", "shift")
        page.on_key("arrowright", lambda: self.go_to(self.now + _LEAP), "5 s on", "shift")
        page.on_key("home", lambda: self.go_to(0.0), "To the start")
        page.on_key("end", lambda: self.go_to(self.end), "To the end")
        page.on_key("W", worst, "Worst moment")

    def compare(self, others: Sequence[Measure]) -> None:
        """Draw the curves of another run beside those of this one."""
        self._lanes.content = lanes(self._measures, self.end, self._spans, others)

    def go_to(self, seconds: float) -> None:
        """Show a moment."""
        self.now = min(max(seconds, 0.0), self.end)

    def pass_by(self, seconds: float) -> None:
        """Advance by elapsed wall-clock seconds."""
        if not self._is_playing:
            return
        self.go_to(self.now + seconds * _SPEEDS[self._speed.value])
        if self.now >= self.end:
            self.toggle()

    def toggle(self) -> None:
        """Play or pause; at the end from the start."""
        self._is_playing = not self._is_playing
        if self._is_playing and self.now >= self.end:
            self.now = 0.0
        self._play.label = "Pause" if self._is_playing else "Play"

    def draw(self, words: str) -> None:
        """Show the current moment, with a line about it."""
        if not math.isclose(self._slider.value, self.now, abs_tol=self.end / _SLIDER_STEPS):
            self._slider.value = self.now
        self._moment.content = f'<div class="moment"><b>{self.now:.2f} s</b> &ensp;{words}</div>'

    def _take(self, seconds: float) -> None:
        """Where a person has set the slider, which is not sent back."""
        self.now = seconds
