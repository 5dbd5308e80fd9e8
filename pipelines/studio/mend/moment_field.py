"""The field of the side panel for a moment."""

from collections.abc import Callable, Sequence
from typing import Any

from racecar.mapping.mending.manual_constraints import Moment
from racecar.mapping.session.recordings import Recording
from racecar.pipelines.studio.page import Page


class MomentField:
    """Seconds since a recording began, and which recording it is if there are several."""

    def __init__(self, page: Page, name: str, recordings: Sequence[Recording]) -> None:
        """Call this inside the panel's folder that should contain it."""
        self._page = page
        self._names = [f"{number}: {each.name}" for number, each in enumerate(recordings, start=1)]
        self._seconds: Any = page.gui.add_number(f"{name} (s)", 0.0, min=0.0, step=0.1)
        self._drive: Any = page.gui.add_dropdown("in drive", self._names, visible=len(self._names) > 1)

    def show(self, seconds: float, recording: int) -> None:
        """Show a moment."""
        self._seconds.value, self._drive.value = round(seconds, 2), self._names[recording]

    def on_change(self, choose: Callable[[Moment], None]) -> None:
        """Have the worker call ``choose`` with the moment that a user sets."""
        for control in (self._seconds, self._drive):
            self._page.on_change(
                control, lambda _: choose(Moment(self._seconds.value, self._names.index(self._drive.value)))
            )
