"""The room in which the map of a run is edited."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.studio.edit.draft import Draft
from racecar.pipelines.studio.edit.edit_drawing import outlines, paint_edited
from racecar.pipelines.studio.edit.edit_list import EditList
from racecar.pipelines.studio.edit.kinds import KIND_OF_NAME, KINDS
from racecar.pipelines.studio.edit.saving import Saving
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import PATH


class EditRoom:
    """Clicks become the corners of edits, which are drawn over the map at once and saved in the end."""

    takes_drags = False

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
        self._leave_room = leave
        self._is_asked_to_leave = False
        self._build_panel()

    def draw_all(self) -> None:
        """Draw the map with its edits, and the shape that is being drawn."""
        self._page.layers.clear_all()
        self._draw_edits()
        self._draw_corners()

    def step(self, seconds: float) -> None:
        """Nothing moves here."""

    def draw(self) -> None:
        """All is drawn when it changes."""

    def click(self, place: NDArray[np.float64]) -> None:
        """A corner; the first one again closes a shape, the last one again ends a wall."""
        corners = self._draft.corners
        kind = KIND_OF_NAME[self._kind.value]
        end = corners[-1:] if kind == "wall" else corners[:1]
        if len(end) and np.hypot(*(end[0] - place)) < self._page.view.finger:
            self._finish()
            return
        self._is_asked_to_leave = False
        self._draft.add_corner(place)
        self._draw_corners()

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """A drag moves the map here."""

    def close(self) -> None:
        """There is nothing to end."""

    def _build_panel(self) -> None:
        page, gui = self._page, self._page.gui
        with page.folder("Draw"):
            self._kind = gui.add_dropdown("Kind", list(KIND_OF_NAME))
            page.on_change(self._kind, lambda _: self._explain())
            self._help = gui.add_markdown("")
            self._width = gui.add_number("Width (m)", 0.0, min=0.0, step=0.05, hint="0: as a cell.")
            self._limit = gui.add_number("Limit (m/s)", 0.5, min=0.0, step=0.05)
            page.on_press(gui.add_button("Finish the shape"), self._finish)
            page.on_press(gui.add_button("Undo", color="gray"), self._undo)
            self._explain()
        with page.folder("Edits"):
            self._list = EditList(page, self._draw_chosen, self._remove)
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
        self._help.content = f"{KINDS[kind].help} Click the corners, then {end}."
        self._width.visible = kind == "wall"
        self._limit.visible = kind == "speed"

    def _finish(self) -> None:
        kind = KIND_OF_NAME[self._kind.value]
        self._draft.finish(kind, width=self._width.value, limit=self._limit.value)
        self._draw_changed()

    def _undo(self) -> None:
        before = self._draft.edits
        self._draft.undo()
        if self._draft.edits is before:
            self._draw_corners()
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
                Path(self._out.value.strip() or self._folder).expanduser(),
                is_straightened=self._is_straightened.value,
                is_cropped=self._is_cropped.value,
            )
        except UserError as error:
            is_saved = self._saving.is_saved(self._draft.edits)
            self._state.content = f"{'No map was rendered' if is_saved else 'Nothing was written'}. {error}"
            raise
        self._state.content = words
        self._page.tell("Saved", "The panel says what was written.", "green")

    def _leave(self) -> None:
        is_saved = self._saving.is_saved(self._draft.edits) and not len(self._draft.corners)
        if not is_saved and not self._is_asked_to_leave:
            self._is_asked_to_leave = True
            raise UserError("What was drawn is not saved: save it, or press again to leave without it.")
        self._leave_room()

    def _draw_changed(self) -> None:
        self._is_asked_to_leave = False
        self._list.show(self._draft.edits.edits)
        self._draw_edits()
        self._draw_corners()

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

    def _draw_corners(self) -> None:
        corners = self._draft.corners
        self._page.layers.line("drawn", corners, PATH, 3.0)
        self._page.layers.dots("corners", corners, PATH, 9.0)
