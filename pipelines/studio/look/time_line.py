"""The time controls: a slider, play, speed and single steps."""

import math
from collections.abc import Callable
from typing import Any

from racecar.pipelines.studio.page import Page

_SPEEDS = {"½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0, "20 ×": 20.0}
_SHOWN_EVERY = 0.2
"""Seconds between updates of the slider while playing, since each is sent to all pages."""
_LEAST_SECONDS = 0.1
"""Minimum length of the slider, whose two ends must differ."""


class TimeLine:
    """Seconds since the start of a drive, and playback."""

    def __init__(self, page: Page, seconds: float, step: Callable[[int], float]) -> None:
        """``step`` returns the time that many scans later, or earlier if negative."""
        self._end = max(math.ceil(10.0 * seconds) / 10.0, _LEAST_SECONDS)  # it is written under the slider
        self._step = step
        self._is_playing, self._since_shown = False, 0.0
        self.now = 0.0
        gui = page.gui
        self._slider: Any = gui.add_slider("Seconds", 0.0, self._end, min(0.1, self._end / 10), 0.0)
        self._play = gui.add_button("Play")
        self._speed = gui.add_dropdown("Speed", list(_SPEEDS), initial_value="1 ×")
        back_and_on = gui.add_button_group("Step", ("◀ scan", "scan ▶"))
        page.on_change(self._slider, self.go_to)
        page.on_press(self._play, self._toggle)

        @back_and_on.on_click
        async def _(_: object) -> None:
            scans = -1 if back_and_on.value == "◀ scan" else 1
            page.ask(lambda: self.go_to(self._step(scans)))

    def go_to(self, seconds: float) -> None:
        """Show a moment."""
        self.now = min(max(seconds, 0.0), self._end)
        self._show()

    def pass_by(self, seconds: float) -> None:
        """Advance by elapsed wall-clock seconds."""
        if not self._is_playing:
            return
        self.now += seconds * _SPEEDS[self._speed.value]
        self._since_shown += seconds
        if self.now >= self._end:
            self.now = self._end
            self._toggle()
            self._show()
        elif self._since_shown >= _SHOWN_EVERY:
            self._show()

    def _toggle(self) -> None:
        self._is_playing = not self._is_playing
        if self._is_playing and self.now >= self._end:
            self.now = 0.0
        self._play.label = "Pause" if self._is_playing else "Play"

    def _show(self) -> None:
        self._since_shown = 0.0
        self._slider.value = round(self.now, 1)
