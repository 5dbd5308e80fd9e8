"""The finished edits in a list of the panel, one of which is chosen."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from racecar.maps.grid.edits import Edit
from racecar.pipelines.studio.edit.kinds import KINDS
from racecar.pipelines.studio.page import Page

_NONE = "none yet"


class EditList:
    """In the order in which they are drawn over the map."""

    def __init__(
        self,
        page: Page,
        show_choice: Callable[[], None],
        change: Callable[[int], None],
        remove: Callable[[int], None],
    ) -> None:
        self._names: list[str] = []
        self._choice: Any = page.gui.add_dropdown("Chosen", [_NONE])
        page.on_change(self._choice, lambda _: show_choice())
        for label, action in (("Change the chosen one", change), ("Remove the chosen one", remove)):
            button = page.gui.add_button(label, color="gray")
            page.on_press(button, partial(self._with_chosen, action))

    @property
    def chosen(self) -> int | None:
        """The number of an edit, from 0; None where there is none."""
        return self._names.index(self._choice.value) if self._choice.value in self._names else None

    def show(self, edits: Sequence[Edit]) -> None:
        """List these, and choose the last."""
        self._names = [f"{number}: {_described(edit)}" for number, edit in enumerate(edits, start=1)]
        self._choice.options = self._names or [_NONE]
        self._choice.value = (self._names or [_NONE])[-1]

    def _with_chosen(self, action: Callable[[int], None]) -> None:
        if self.chosen is not None:
            action(self.chosen)


def _described(edit: Edit) -> str:
    name = KINDS[edit.kind].name.lower()
    if edit.kind == "speed":
        return f"{name} {edit.limit:g} m/s, {len(edit.points)} corners"
    return f"{name}, {len(edit.points)} corners"
