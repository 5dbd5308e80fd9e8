"""What is tried is shown before it is kept, what is refused changes nothing, and every step can be undone."""

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mending.manual_constraints import Distrust, ManualConstraint, Moment, NotSamePlace
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.quality.map_quality import Verdict
from racecar.maps.errors import UserError
from racecar.maps.grid.edits import Edit
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.studio.mend.correction import Correction
from racecar.pipelines.studio.mend.corrector import CorrectedMap, Corrector
from tests.mapping.mending.bent import error
from tests.mapping.mending.test_mender import TRUE
from tests.pipelines.studio.mending import wrongly_closed

WRONG_LOOP = NotSamePlace(Moment(16.0), Moment(86.0))
NO_LOOP = NotSamePlace(Moment(5.0), Moment(40.0))
DISTRUST = Distrust("wheels", Moment(20.0), Moment(24.0))


class Waiting:
    """Corrects when it is let."""

    def __init__(self) -> None:
        self.corrector = Corrector(wrongly_closed(), MappingConfig())
        self.asked: list[MapEdits] = []

    def answer(self) -> CorrectedMap:
        return self.corrector.map_with(self.asked.pop())


@pytest.fixture
def waiting() -> Waiting:
    return Waiting()


@pytest.fixture
def correction(waiting: Waiting) -> Correction:
    """Of a map whose first verdict has come."""
    made = Correction(MapEdits(), waiting.asked.append)
    made.take(waiting.answer())
    return made


def kept(correction: Correction) -> tuple[ManualConstraint, ...]:
    return correction.decided.edits.constraints


def test_a_preview_is_kept_undone_and_removed(correction: Correction, waiting: Waiting) -> None:
    before = correction.decided
    assert before.map.quality.verdict == Verdict.WRONG
    correction.add(WRONG_LOOP)
    assert correction.shown is before
    correction.take(waiting.answer())
    preview = correction.shown
    assert preview is not None and correction.adds
    assert preview.map.quality.verdict == Verdict.GOOD
    assert "takes out 3 ties" in preview.map.words(-1)
    assert correction.kept is before
    with pytest.raises(UserError, match="Keep or discard first"):
        correction.add(DISTRUST)
    correction.discard()
    assert correction.shown is before
    correction.add(WRONG_LOOP)
    correction.take(waiting.answer())
    correction.keep()
    assert kept(correction) == (WRONG_LOOP,)
    correction.remove(0)
    correction.take(waiting.answer())
    assert not correction.adds
    correction.keep()
    assert kept(correction) == ()
    assert correction.decided.map.quality.verdict == Verdict.WRONG
    correction.undo()
    assert kept(correction) == (WRONG_LOOP,)
    correction.undo()
    assert correction.kept is before
    with pytest.raises(UserError, match="nothing to undo"):
        correction.undo()


def test_what_is_refused_changes_nothing(correction: Correction, waiting: Waiting) -> None:
    before = correction.decided
    correction.add(NO_LOOP)
    with pytest.raises(RefusedConstraintError, match="Nothing ties"):
        correction.take(waiting.answer())
    assert correction.shown is before
    assert correction.preview is None
    for action in (correction.keep, correction.discard):
        with pytest.raises(UserError, match="Nothing is tried"):
            action()


def test_nothing_is_tried_before_the_map_is_judged(waiting: Waiting) -> None:
    unjudged = Correction(MapEdits(), waiting.asked.append)
    with pytest.raises(UserError, match="not judged yet"):
        unjudged.add(WRONG_LOOP)


def test_constraints_that_a_file_holds_are_there_though_they_are_refused(waiting: Waiting) -> None:
    edits = MapEdits().with_entry(NO_LOOP)
    opened = Correction(edits, waiting.asked.append)
    opened.take(waiting.answer())
    assert "Nothing ties" in opened.decided.map.words(0)
    opened.add(WRONG_LOOP)
    opened.take(waiting.answer())
    opened.keep()
    assert kept(opened) == (NO_LOOP, WRONG_LOOP)
    opened.remove(0)
    opened.take(waiting.answer())
    opened.keep()
    assert kept(opened) == (WRONG_LOOP,)


@pytest.mark.parametrize(
    "later",
    [(WRONG_LOOP, DISTRUST), (DISTRUST,), (DISTRUST, WRONG_LOOP), (NO_LOOP, DISTRUST), ()],
)
def test_a_map_depends_on_its_constraints_and_not_on_those_before(
    later: tuple[ManualConstraint, ...],
) -> None:
    used, fresh = (Corrector(wrongly_closed(), MappingConfig()) for _ in range(2))
    for constraints in ((WRONG_LOOP,), (WRONG_LOOP, NO_LOOP, DISTRUST)):
        used.map_with(_edits(constraints))
    again, expected = (each.map_with(_edits(later)) for each in (used, fresh))
    np.testing.assert_array_equal(again.map_from_keyframe, expected.map_from_keyframe)
    np.testing.assert_array_equal(again.grid.cells, expected.grid.cells)
    assert list(map(str, again.outcomes)) == list(map(str, expected.outcomes))


def test_what_was_drawn_moves_with_the_map() -> None:
    session = wrongly_closed()
    corrector = Corrector(session, MappingConfig())
    x, y = session.map_from_keyframe[150, :2].tolist()
    corners = np.array([[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]) + np.array([x, y])
    drawn = MapEdits().with_entry(Edit("unknown", corners))
    at_first, then = (corrector.map_with(edits) for edits in (drawn, drawn.with_entry(WRONG_LOOP)))
    assert error(session, TRUE) > 1.0
    for map, place in ((at_first, (x, y)), (then, TRUE[150, :2])):
        row, column = map.grid.cell_of(np.array([place]))[0]
        assert map.grid.cells[row, column] == -1


def _edits(constraints: tuple[ManualConstraint, ...]) -> MapEdits:
    edits = MapEdits()
    for constraint in constraints:
        edits = edits.with_entry(constraint)
    return edits
