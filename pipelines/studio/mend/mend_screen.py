"""The screen for correcting the map of a run by hand."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.mending.manual_constraints import Distance, Moment, RightAngle, Straight
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.raster import Raster
from racecar.pipelines.files.edits_file import MapEdits, edits_beside
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.tone import TONE_OF_VERDICT
from racecar.pipelines.runs.error_sentences import in_one_sentence
from racecar.pipelines.runs.output_places import OutputFolder
from racecar.pipelines.runs.view.headline import Headline
from racecar.pipelines.runs.view.run_folder import expected_words
from racecar.pipelines.studio.edit.saving import Saving
from racecar.pipelines.studio.mend.correcting_process import CorrectingProcess
from racecar.pipelines.studio.mend.correction import Correction, Step
from racecar.pipelines.studio.mend.corrector import CorrectedMap, Corrector
from racecar.pipelines.studio.mend.described import described
from racecar.pipelines.studio.mend.doubt_list import DoubtList
from racecar.pipelines.studio.mend.mend_tools import PassTool, TwoPlaces, WallTool
from racecar.pipelines.studio.mend.moment_field import MomentField
from racecar.pipelines.studio.mend.passes import Passes
from racecar.pipelines.studio.mend.wall_points import WallConstraint, as_at_first
from racecar.pipelines.studio.outlines import cross
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen, Tool
from racecar.pipelines.studio.tools import ToolChoice

_NEAR = 14.0
"""Metres visible from bottom to top when looking at a doubt: both passes, which are some metres long."""
_MARGIN = 3.0
"""Metres beyond the path that are visible at first. Chosen by judgement: the walls of a corridor."""
_MARKER = 0.6
"""Size in metres of the cross at a doubtful place."""
_NONE = "none yet"
_CHOOSE = "Choose a doubt, or click two places of the path."


class MendScreen(Screen):
    """Doubts are looked at, constraints are previewed and kept, and the map is saved with them."""

    def __init__(
        self,
        page: Page,
        run: Path,
        config: MappingConfig,
        session: Session,
        edits: MapEdits,
        grid: Raster | None,
        *,
        reopen: Callable[[], None],
        leave: Callable[[], None],
    ) -> None:
        """``session``, ``edits`` and ``grid`` are of the ``run`` in a folder; ``config`` renders its map
        where it lies. ``reopen`` opens this screen again, ``leave`` the run."""
        self._page, self._run, self._config, self._session, self._edits = page, run, config, session, edits
        self._reopen, self._leave = reopen, leave
        self._process = CorrectingProcess(run, config)
        self._waiting: deque[Callable[[], None]] = deque()
        """What was pressed while the map was corrected."""
        self._passes = Passes(session)
        self._second_points = np.zeros((0, 2))
        """(N, 2) metres in the map: what of the second pass can be dragged."""
        self._measured: TwoPlaces = (0.0, 0.0), (0.0, 0.0)
        self._drawn: Step | None = None
        self._names: list[str] = []
        """Names of the constraints in the list."""
        self._build_panel()
        self._correction = Correction(edits, self._ask)
        if grid is not None:
            page.layers.map(grid)
        path = session.map_from_base[:, :2]
        page.view.show_whole(path.min(axis=0) - _MARGIN, path.max(axis=0) + _MARGIN)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is being corrected or saved."""
        return not self._process.is_busy

    @property
    def tool(self) -> Tool:
        """What clicks on the map name."""
        return self._tools.tool

    @property
    def would_be_lost(self) -> str:
        """Constraints that are not saved."""
        kept = self._correction.kept
        if self._correction.preview is None and (kept is None or kept.edits.text == self._edits.text):
            return ""
        return "What was corrected is not saved: save it, or press again to leave without it."

    def step(self, seconds: float) -> None:
        """Receive what was asked for, then do what was pressed meanwhile."""
        if (answer := self._answer()) is not None:
            if isinstance(answer, str):
                self._reopen()
                self._page.tell("Saved", answer, "green")
                return
            self._take(answer)
        while self.is_idle and self._waiting:
            self._waiting.popleft()()

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def _answer(self) -> CorrectedMap | str | None:
        """A map, or what was saved, in words; None while there is no answer."""
        try:
            answer: CorrectedMap | str | None = self._process.answer()
        except Exception as error:
            kept = self._correction.kept
            self._tell_state()
            self._tell(literal(in_one_sentence(error)))
            if kept is not None and edits_beside(self._run).text == kept.edits.text:
                self._edits = kept.edits  # they were saved, although no map could be rendered
            raise
        return answer

    def _take(self, map: CorrectedMap) -> None:
        try:
            self._correction.take(map)
        except RefusedConstraintError as refused:
            self._show()
            self._tell(f"**It was refused.** {literal(str(refused))}")
            if refused.instead is not None:
                self._look_at(*refused.instead)
            raise
        self._show()

    def _ask(self, edits: MapEdits) -> None:
        self._process.ask(partial(_map_with, edits))
        self._tell_work("The map is being judged …")

    def _once_idle(self, action: Callable[[], None]) -> None:
        """Execute an action once what was asked for before is there."""
        if self.is_idle and not self._waiting:
            action()
        else:
            self._waiting.append(action)

    def _build_panel(self) -> None:
        page, gui = self._page, self._page.gui
        self._doubts = DoubtList(page, self._choose_doubt)
        with page.folder("Two moments"):
            self._why = gui.add_markdown(_CHOOSE)
            recordings = self._session.times.recordings
            self._moments = [MomentField(page, name, recordings) for name in ("First", "Second")]
            for is_second, field in enumerate(self._moments):
                field.on_change(partial(self._choose_moment, bool(is_second)))
            self._add_button("Same place", self._same_place)
            self._add_button("Not the same place", self._not_same_place)
            self._turn: Any = gui.add_slider("Turn second (°)", -180.0, 180.0, 1.0, 0.0)
            page.on_change(self._turn, self._turn_second)
        with page.folder("Correction"):
            self._state = gui.add_markdown("")
            self._decide = [
                self._add_button("Keep", self._keep_it, "green", is_visible=False),
                self._add_button("Discard", self._discard, "gray", is_visible=False),
            ]
            self._add_button("Undo", self._undo, "gray")
            self._add_button("Save and render", self._save)
            page.on_press(gui.add_button("Back to the run", color="gray"), self._leave)
        with page.folder("Constraints", is_open=False):
            self._choice: Any = gui.add_dropdown("Chosen", [_NONE])
            page.on_change(self._choice, lambda _: self._tell_chosen())
            self._chosen_words = gui.add_markdown("")
            self._add_button("Remove the chosen one", self._remove, "gray")
        with page.folder("More to state", is_open=False):
            self._tools = ToolChoice(page, *self._make_tools())
            self._metres: Any = gui.add_number("Metres", 1.0, min=0.01, step=0.01, visible=False)
            self._is_so_long = self._add_button(
                "They are so far apart",
                lambda: self._add_of_walls(Distance(self._measured, self._metres.value)),
                is_visible=False,
            )
            gui.add_markdown("From the first moment to the second:")
            self._add_button("Distrust the wheels", self._distrust_wheels)
            self._add_button("Distrust the scans", self._distrust_scans)

    def _add_button(
        self, label: str, action: Callable[[], None], color: Any = None, *, is_visible: bool = True
    ) -> Any:
        button = self._page.gui.add_button(label, color=color, visible=is_visible)
        self._page.on_press(button, lambda: self._once_idle(action))
        return button

    def _make_tools(self) -> list[Tool]:
        page = self._page
        return [
            PassTool(page, lambda: self._second_points, self._choose_place, self._move_second),
            WallTool(
                page, "Distance between walls", "Click two points of walls, then say how far.", self._measure
            ),
            WallTool(
                page,
                "Straight wall",
                "Click both ends of a wall that is straight.",
                lambda places: self._once_idle(lambda: self._add_of_walls(Straight(places))),
            ),
            WallTool(
                page,
                "Right angle",
                "Click two walls that are at right angles.",
                lambda places: self._once_idle(lambda: self._add_of_walls(RightAngle(places))),
            ),
        ]

    def _choose_doubt(self, doubt: DoubtfulSegment) -> None:
        if (shown := self._correction.shown) is not None:
            self._passes.choose(*self._passes.pair_of(doubt, shown.map.map_from_keyframe))
            self._why.content = literal(doubt.why)
            self._page.view.go_to(doubt.place, _NEAR)
            self._show_moments()

    def _look_at(self, first: Moment, second: Moment) -> None:
        """Look at two moments that may be meant."""
        self._passes.choose_moments(first, second)
        self._why.content = "These two may be meant."
        self._show_moments()

    def _choose_moment(self, is_second: bool, moment: Moment) -> None:
        self._passes.choose_moment(moment, is_second=is_second)
        self._show_moments()

    def _choose_place(self, place: NDArray[np.float64]) -> None:
        if (shown := self._correction.shown) is not None:
            self._passes.choose_place(place, shown.map.map_from_keyframe)
            self._why.content = "Chosen on the map."
            self._show_moments()

    def _show_moments(self) -> None:
        times = self._session.times
        for field, keyframe in zip(self._moments, (self._passes.first, self._passes.second), strict=True):
            if keyframe is not None:
                field.show(float(times.seconds[keyframe]), int(times.numbers[keyframe]))
        self._turn.value = 0.0
        self._draw_passes()

    def _turn_second(self, degrees: float) -> None:
        self._passes.moved[2] = math.radians(degrees)
        self._draw_passes()

    def _move_second(self, shift: NDArray[np.float64], *, is_over: bool) -> None:
        if is_over:
            self._passes.moved[:2] += shift
        self._draw_passes((0.0, 0.0) if is_over else shift)

    def _same_place(self) -> None:
        self._correction.add(self._passes.same_place(self._correction.decided.map.map_from_keyframe))

    def _not_same_place(self) -> None:
        self._correction.add(self._passes.not_same_place())

    def _distrust_wheels(self) -> None:
        self._correction.add(self._passes.distrust("wheels"))

    def _distrust_scans(self) -> None:
        self._correction.add(self._passes.distrust("scans"))

    def _measure(self, places: TwoPlaces) -> None:
        self._measured = places
        self._metres.value = round(math.dist(*places), 2)
        self._metres.visible = self._is_so_long.visible = True

    def _add_of_walls(self, constraint: WallConstraint) -> None:
        """Try a constraint between walls of the map that is shown."""
        shown = self._correction.decided.map.map_from_keyframe
        store, first = self._session.keyframes, self._session.map_from_keyframe
        self._correction.add(as_at_first(constraint, store, shown, first))

    def _remove(self) -> None:
        if self._choice.value in self._names:
            self._correction.remove(self._names.index(self._choice.value))

    def _keep_it(self) -> None:
        self._correction.keep()
        self._passes.choose(None)
        self._why.content = _CHOOSE
        self._show_moments()
        self._show()

    def _discard(self) -> None:
        self._correction.discard()
        self._show()

    def _undo(self) -> None:
        self._correction.undo()
        self._show()

    def _save(self) -> None:
        """Save what is kept, and render the map with it."""
        saving = Saving(self._run, self._config, self._edits)
        self._page.check_place(saving.place(self._run), [self._run])
        self._process.ask(partial(_save, saving, self._correction.decided.edits, self._run))
        self._tell_work("The map is being rendered …")

    def _show(self) -> None:
        """Show the map, its doubts and its constraints."""
        if (shown := self._correction.shown) is None:
            return
        if shown is not self._drawn:
            self._draw(shown.map)
            self._drawn = shown
        for button in self._decide:
            button.visible = self._correction.preview is not None
        constraints = shown.edits.constraints
        self._names = [f"{number}: {described(each)}" for number, each in enumerate(constraints, start=1)]
        self._choice.options = self._names or [_NONE]
        self._choice.value = (self._names or [_NONE])[-1]
        self._tell_chosen()
        self._tell_state()

    def _draw(self, map: CorrectedMap) -> None:
        layers, poses, doubts = self._page.layers, map.map_from_keyframe, map.quality.segments
        layers.map(map.grid)
        path = compose(poses, self._session.keyframe_from_base)[:, :2]
        is_driven = np.diff(self._session.times.numbers) == 0
        layers.segments("driven", np.stack([path[:-1], path[1:]], axis=1)[is_driven])
        crosses = [cross(doubt.place, _MARKER) for doubt in doubts]
        layers.segments("doubts", np.array(crosses).reshape(-1, 2, 2))
        names = [self._passes.name_of(doubt, poses) for doubt in doubts]
        self._doubts.show(doubts, [f"{number}: {name}" for number, name in enumerate(names, start=1)])
        self._draw_passes()

    def _draw_passes(self, drag: ArrayLike = (0.0, 0.0)) -> None:
        """Draw both passes: in a preview as it has them, otherwise the second as it was moved."""
        if (shown := self._correction.shown) is None:
            return
        is_tried = self._correction.preview is not None
        moved = np.zeros(3) if is_tried else self._passes.moved + np.append(drag, 0.0)
        first, second = self._passes.points(shown.map.map_from_keyframe, moved)
        self._draw_pass("first", first, self._passes.first)
        self._draw_pass("second", second, self._passes.second)
        self._second_points = np.zeros((0, 2)) if is_tried else second

    def _draw_pass(self, name: str, points: NDArray[np.float64], keyframe: int | None) -> None:
        layers = self._page.layers
        layers.dots(f"{name}_pass", points)
        if keyframe is not None:
            layers.explain(f"{name}_pass", f"{name} pass, {self._passes.words_of(keyframe)}")

    def _tell(self, words: str) -> None:
        self._state.content = words

    def _tell_work(self, words: str) -> None:
        self._page.frame.head(Headline(words))
        self._tell(words)

    def _tell_state(self) -> None:
        """The verdict, and what the preview does."""
        if (shown := self._correction.shown) is None:
            return
        is_tried, quality = self._correction.preview is not None, shown.map.quality
        headline = Headline(
            f"{'Preview: the map would be' if is_tried else 'The map is'} {quality.verdict.value}",
            TONE_OF_VERDICT[quality.verdict.value],
            expected_words(quality.error_per_10_m, quality.error_of_whole),
            quality.reasons,
        )
        self._page.frame.head(headline)
        effect = f" {literal(shown.map.words(-1))}" if self._correction.adds else ""
        self._tell(f"**A preview, not kept yet.**{effect}" if is_tried else _said(shown.edits))

    def _tell_chosen(self) -> None:
        """What the chosen constraint did."""
        shown = self._correction.shown
        is_there = shown is not None and self._choice.value in self._names
        words = shown.map.words(self._names.index(self._choice.value)) if shown and is_there else ""
        self._chosen_words.content = literal(words)


def _said(edits: MapEdits) -> str:
    count = len(edits.constraints)
    return f"{count or 'No'} constraint{'' if count == 1 else 's'} so far."


def _map_with(edits: MapEdits, corrector: Corrector) -> CorrectedMap:
    return corrector.map_with(edits)


def _save(saving: Saving, edits: MapEdits, run: Path, _: Corrector) -> str:
    return saving.save(edits, run, _is_checked, is_straightened=False, is_cropped=False)


def _is_checked(_: OutputFolder, __: Sequence[Path]) -> None:
    """The page has asked its user."""
