"""The screen for editing the map of a run."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.rendering import pixels_of
from racecar.maps.errors import UserError
from racecar.maps.grid.edits import EDIT_KINDS, Edit, edited, keepout_mask, speed_mask
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import as_written
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.studio.edit.corner_tool import CornerTool
from racecar.pipelines.studio.edit.draft import Draft
from racecar.pipelines.studio.edit.kinds import KIND_OF_NAME, NAMES
from racecar.pipelines.studio.edit.saving import Saving
from racecar.pipelines.studio.layers import LAYERS
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import Color
from racecar.pipelines.studio.screen import Screen, Tool

_NONE = "none yet"


class EditScreen(Screen):
    """Shapes become edits, which are drawn over the map at once and saved at the end."""

    def __init__(
        self,
        page: Page,
        folder: Path,
        config: MappingConfig,
        grid: TiledGrid,
        edits: MapEdits,
        leave: Callable[[], None],
    ) -> None:
        """``grid`` is the map of the run in ``folder`` without its ``edits``; ``leave`` opens that run."""
        self._page, self._folder, self._grid, self._rendering = page, folder, grid, config.rendering
        self._draft = Draft(grid, edits)
        self._corners = CornerTool(page, self._draft, self._finish, lambda: self._say_why(""))
        self._saving = Saving(folder, config, edits)
        self._names: list[str] = []
        """Names of the edits in the list."""
        self._build_panel(leave)
        low = grid.map_from_grid[:2]
        page.view.show_whole(low, low + grid.metres)
        self._show_edits()

    @property
    def tool(self) -> Tool:
        """The tool that draws corners."""
        return self._corners

    @property
    def would_be_lost(self) -> str:
        """Unsaved edits."""
        if self._saving.is_saved(self._draft.edits) and not len(self._draft.corners):
            return ""
        return "What was drawn is not saved: save it, or press again to leave without it."

    def _build_panel(self, leave: Callable[[], None]) -> None:
        page, gui = self._page, self._page.gui
        with page.folder("Draw"):
            self._kind: Any = gui.add_dropdown("Kind", list(KIND_OF_NAME))
            page.on_change(self._kind, self._choose_kind)
            self._help = gui.add_markdown("")
            self._width: Any = gui.add_number("Width (m)", 0.0, min=0.0, step=0.05, hint="0: as a cell.")
            self._limit: Any = gui.add_number("Limit (m/s)", 0.5, min=0.0, step=0.05)
            page.on_press(gui.add_button("Finish the shape"), self._finish)
            page.on_press(gui.add_button("Undo", color="gray"), self._undo)
            self._why: Any = gui.add_markdown("", visible=False)
            self._choose_kind(self._kind.value)
        with page.folder("Edits"):
            self._choice: Any = gui.add_dropdown("Chosen", [_NONE])
            page.on_change(self._choice, lambda _: self._draw_chosen())
            for label, action in (
                ("Change the chosen one", self._change),
                ("Remove the chosen one", self._remove),
            ):
                page.on_press(gui.add_button(label, color="gray"), action)
        with page.folder("Save"):
            self._out = gui.add_text("Folder", str(self._folder))
            self._is_straightened = gui.add_checkbox("Straighten along the walls", False)
            self._is_cropped = gui.add_checkbox("Crop to what was driven", False)
            page.on_press(gui.add_button("Save and render"), self._save)
            page.on_press(gui.add_button("Back to the run", color="gray"), leave)
            self._state = gui.add_markdown("")

    def _choose_kind(self, name: str) -> None:
        self._corners.kind = kind = KIND_OF_NAME[name]
        self._help.content = self._corners.explain()
        self._width.visible = kind == "wall"
        self._limit.visible = kind == "speed"

    @property
    def _chosen(self) -> int:
        """Index of the selected edit, from 0. Raises UserError if there is none."""
        if self._choice.value not in self._names:
            raise UserError("There is no edit yet: draw a shape, and finish it.")
        return self._names.index(self._choice.value)

    def _change(self) -> None:
        number = self._chosen
        edit = self._draft.edits.edits[number]
        self._draft.reopen(number)
        self._kind.value = NAMES[edit.kind]
        if edit.kind == "wall":
            self._width.value = edit.width
        elif edit.kind == "speed":
            self._limit.value = edit.limit
        self._choose_kind(NAMES[edit.kind])
        self._show_edits()

    def _remove(self) -> None:
        self._draft.remove(self._chosen)
        self._show_edits()

    def _finish(self) -> None:
        try:
            self._draft.finish(self._corners.kind, width=self._width.value, limit=self._limit.value)
        except UserError as error:
            self._say_why(f"**Not finished.** {literal(str(error))}")
            raise
        self._show_edits()

    def _say_why(self, words: str) -> None:
        """Why the shape cannot be finished, until it changes: longer than a message is shown."""
        self._why.content, self._why.visible = words, bool(words)

    def _undo(self) -> None:
        before = self._draft.edits
        self._draft.undo()
        if self._draft.edits is before:
            self._corners.draw()
        else:
            self._show_edits()

    def _save(self) -> None:
        if len(self._draft.corners):
            raise UserError("A shape is not finished: finish it, or undo its corners, and save then.")
        self._state.content = "The map is being rendered …"
        try:
            words = self._saving.save(
                self._draft.edits,
                typed_path(self._out.value) if self._out.value.strip() else self._folder,
                self._page.check_place,
                is_straightened=self._is_straightened.value,
                is_cropped=self._is_cropped.value,
            )
        except UserError as error:
            is_saved = self._saving.is_saved(self._draft.edits)
            self._state.content = (
                f"{'No map was rendered' if is_saved else 'Nothing was written'}. {literal(str(error))}"
            )
            raise
        self._state.content = literal(words)
        self._page.tell("Saved", "The panel says what was written.", "green")

    def _show_edits(self) -> None:
        """List the edits, select the last, and draw them over the map."""
        edits, layers = self._draft.edits.edits, self._page.layers
        self._names = [f"{number}: {_described(edit)}" for number, edit in enumerate(edits, start=1)]
        self._choice.options = self._names or [_NONE]
        self._choice.value = (self._names or [_NONE])[-1]
        layers.map(self._written(), self._tints())
        for kind in EDIT_KINDS:
            layers.segments(kind, _outlines([edit for edit in edits if edit.kind == kind]))
        self._draw_chosen()
        self._corners.draw()

    def _draw_chosen(self) -> None:
        chosen = [self._draft.edits.edits[self._chosen]] if self._names else []
        self._page.layers.segments("chosen", _outlines(chosen))

    def _written(self) -> TiledGrid:
        """The cells as they will be written."""
        return as_written(edited(self._grid, self._draft.edits.edits), **pixels_of(self._rendering))

    def _tints(self) -> list[tuple[TiledGrid, Color]]:
        """Speed and keep-out zones."""
        edits = self._draft.edits.edits
        kinds = {edit.kind for edit in edits}
        tints = []
        if "speed" in kinds:
            tints.append((speed_mask(self._grid, edits)[0], LAYERS["speed"].color))
        if "keepout" in kinds:
            tints.append((keepout_mask(self._grid, edits), LAYERS["keepout"].color))
        return tints


def _outlines(edits: Sequence[Edit]) -> NDArray[np.float64]:
    """(N, 2, 2) lines between the corners of each edit; those of a wall are not closed."""
    return np.concatenate([np.zeros((0, 2, 2)), *(_outline(edit) for edit in edits)])


def _outline(edit: Edit) -> NDArray[np.float64]:
    ends = np.stack([edit.points, np.roll(edit.points, -1, axis=0)], axis=1)
    return ends[:-1] if edit.kind == "wall" else ends


def _described(edit: Edit) -> str:
    name = NAMES[edit.kind].lower()
    if edit.kind == "speed":
        return f"{name} {edit.limit:g} m/s, {len(edit.points)} corners"
    return f"{name}, {len(edit.points)} corners"
