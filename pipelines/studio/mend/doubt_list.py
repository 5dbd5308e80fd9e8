"""The list of doubts in the side panel: what is left to do."""

from collections.abc import Callable, Sequence
from typing import Any

from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.pipelines.studio.page import Page

_MOST_NAMED = 6
"""Maximum doubts in the list, because the rest of the panel should remain visible. Others follow when these
are corrected."""


class DoubtList:
    """A button for each doubt."""

    def __init__(self, page: Page, choose: Callable[[DoubtfulSegment], None]) -> None:
        self._page, self._choose = page, choose
        self._folder = page.folder("Doubts")
        self._controls: list[Any] = []

    def show(self, doubts: Sequence[DoubtfulSegment], names: Sequence[str]) -> None:
        """List doubts, with a name for each."""
        for control in self._controls:
            control.remove()
        gui = self._page.gui
        with self._folder:
            self._controls = [self._button(*each) for each in zip(doubts[:_MOST_NAMED], names, strict=False)]
            if len(doubts) > _MOST_NAMED:
                self._controls.append(gui.add_markdown(f"And {len(doubts) - _MOST_NAMED} more."))
            elif not doubts:
                self._controls.append(gui.add_markdown("None is left."))

    def _button(self, doubt: DoubtfulSegment, name: str) -> Any:
        button = self._page.gui.add_button(name, color="orange")
        self._page.on_press(button, lambda: self._choose(doubt))
        return button
