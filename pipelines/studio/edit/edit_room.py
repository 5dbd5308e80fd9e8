"""The room in which the map of a run is edited."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.studio.edit.draft import Draft
from racecar.pipelines.studio.edit.edit_drawing import outlines, paint_edited
from racecar.pipelines.studio.edit.edit_list import EditList
from racecar.pipelines.studio.edit.kinds import KIND_OF_NAME, KINDS
from racecar.pipelines.studio.edit.saving import Saving
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import PATH
from racecar.pipelines.studio.room import Room


class EditRoom(Room):
    """Clicks become the corners of edits, which are drawn over the map at once and saved in the end."""

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
        self._saving = Saving(folder, config, edits)
        self._leave = leave
        self._build_panel()

    def draw_all(self) -> None:
        """Draw the map with its edits, and the shape that is being drawn."""
        self._page.layers.clear_all()
        self._draw_edits()
        self._draw_corners(self._draft.corners)

    def click(self, place: NDArray[np.float64]) -> None:
        """A corner; the first one again closes a shape, the last one again ends a wall."""
        corners, corner = self._draft.corners, self._corner_at(place)
        is_wall = KIND_OF_NAME[self._kind.value] == "wall"
        if corner is not None and corner == (len(corners) - 1 if is_wall else 0):
            self._finish()
            return
        self._draft.add_corner(place if corner is None else corners[corner])
        self._draw_corners(self._draft.corners)

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Corners of the shape that is being drawn are dragged; elsewhere a drag moves the map."""
        return self._corner_at(start) is not None

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """Move a corner."""
        number = self._corner_at(start)
        if number is None:
            return
        corners = self._draft.corners
        corners[number] = end
        self._draw_corners(corners)
        if is_over:
            self._draft.move_corner(number, end)

    @property
    def would_be_lost(self) -> str:
        """What was drawn since it was saved."""
        if self._saving.is_saved(self._draft.edits) and not len(self._draft.corners):
            return ""
        return "What was drawn is not saved: save it, or press again to leave without it."

    def _build_panel(self) -> None:
        page, gui = self._page, self._page.gui
        with page.folder("Draw"):
            self._kind: Any = gui.add_dropdown("Kind", list(KIND_OF_NAME))
            page.on_change(self._kind, lambda _: self._explain())
            self._help = gui.add_markdown("")
            self._width: Any = gui.add_number("Width (m)", 0.0, min=0.0, step=0.05, hint="0: as a cell.")
            self._limit: Any = gui.add_number("Limit (m/s)", 0.5, min=0.0, step=0.05)
            page.on_press(gui.add_button("Finish the shape"), self._finish)
            page.on_press(gui.add_button("Undo", color="gray"), self._undo)
            self._explain()
        with page.folder("Edits"):
            self._list = EditList(page, self._draw_chosen, self._change, self._remove)
            self._list.show(self._draft.edits.edits)
        with page.folder("Save"):
            self._out = gui.add_text("Folder", str(self._folder))
            self._is_straightened = gui.add_checkbox("Straighten along the walls", False)
            self._is_cropped = gui.add_checkbox("Crop to what was driven", False)
            page.on_press(gui.add_button("Save and render"), self._save)
            page.on_press(gui.add_button("Back to the run", color="gray"), self._leave)
            self._state = gui.add_markdown("")

    def _explain(self) -> None:
        kind = KIND_OF_NAME[self._kind.value]
        end = "the last corner again" if kind == "wall" else "the first corner again"
        self._help.content = f"{KINDS[kind].help} Click the corners, then {end}; drag a corner to move it."
        self._width.visible = kind == "wall"
        self._limit.visible = kind == "speed"

    def _corner_at(self, place: NDArray[np.float64]) -> int | None:
        """The number of the corner that is meant by a place (2,), if any is."""
        corners = self._draft.corners
        if not len(corners):
            return None
        distances = np.hypot(*(corners - place).T)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] < self._page.view.finger else None

    def _change(self, number: int) -> None:
        edit = self._draft.edits.edits[number]
        self._draft.reopen(number)
        self._kind.value = KINDS[edit.kind].name
        if edit.kind == "wall":
            self._width.value = edit.width
        elif edit.kind == "speed":
            self._limit.value = edit.limit
        self._explain()
        self._draw_changed()

    def _finish(self) -> None:
        kind = KIND_OF_NAME[self._kind.value]
        self._draft.finish(kind, width=self._width.value, limit=self._limit.value)
        self._draw_changed()

    def _undo(self) -> None:
        before = self._draft.edits
        self._draft.undo()
        if self._draft.edits is before:
            self._draw_corners(self._draft.corners)
        else:
            self._draw_changed()

    def _remove(self, number: int) -> None:
        self._draft.remove(number)
        self._draw_changed()

    def _save(self) -> None:
        if len(self._draft.corners):
            raise UserError("A shape is not finished: finish it, or undo its corners, and save then.")
        self._state.content = "The map is being rendered …"
        try:
            words = self._saving.save(
                self._draft.edits,
                typed_path(self._out.value) if self._out.value.strip() else self._folder,
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

    def _draw_changed(self) -> None:
        self._list.show(self._draft.edits.edits)
        self._draw_edits()
        self._draw_corners(self._draft.corners)

    def _draw_edits(self) -> None:
        page, edits = self._page, self._draft.edits.edits
        page.layers.image("map", paint_edited(self._grid, edits, self._rendering, page.ground))
        for key, kind in KINDS.items():
            page.layers.segments(key, outlines([edit for edit in edits if edit.kind == key]), kind.color)
        self._draw_chosen()
        self._draw_legend()

    def _draw_chosen(self) -> None:
        number = self._list.chosen
        chosen = () if number is None else self._draft.edits.edits[number : number + 1]
        self._page.layers.segments("chosen", outlines(chosen), PATH, 5.0)

    def _draw_legend(self) -> None:
        there = {edit.kind for edit in self._draft.edits.edits}
        entries = [Entry(kind.name.lower(), [kind.color]) for key, kind in KINDS.items() if key in there]
        self._page.legend.show([*entries, Entry("being drawn, or chosen", [PATH])])

    def _draw_corners(self, corners: NDArray[np.float64]) -> None:
        self._page.layers.line("drawn", corners, PATH, 3.0)
        self._page.layers.dots("corners", corners, PATH, 9.0)
