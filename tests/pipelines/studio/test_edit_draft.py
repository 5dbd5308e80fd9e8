"""Edits while they are drawn, before a browser is there."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import FREE
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.pipelines.files.edits_file import MapEdits, load_edits, save_edits
from racecar.pipelines.studio.edit.draft import Draft
from racecar.pipelines.studio.edit.kinds import KIND_OF_NAME

SQUARE = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]


def a_draft(edits: MapEdits | None = None) -> Draft:
    """On a floor of 10 x 10 m."""
    return Draft(TiledGrid({}, 200, 200, 0.05, np.zeros(3), FREE), edits or MapEdits())


def draw(
    draft: Draft, corners: list[list[float]], kind: str, *, width: float = 0.0, limit: float = 0.5
) -> None:
    for corner in corners:
        draft.add_corner(np.array(corner))
    draft.finish(KIND_OF_NAME[kind], width=width, limit=limit)


def test_all_kinds_are_drawn_and_read_again_from_their_file(tmp_path: Path) -> None:
    draft = a_draft()
    for name in KIND_OF_NAME:
        draw(draft, SQUARE, name, width=0.1)
    save_edits(draft.edits, tmp_path)
    read = load_edits(tmp_path / "edits.yaml").edits
    assert [edit.kind for edit in read] == list(KIND_OF_NAME.values())
    assert [(edit.width, edit.limit) for edit in read if edit.kind in ("wall", "speed")] == [
        (0.1, 0.0),
        (0.0, 0.5),
    ]
    for edit in read:
        np.testing.assert_array_equal(edit.points, SQUARE)


@pytest.mark.parametrize(
    ("corners", "kind", "words"),
    [
        (SQUARE[:2], "Keep out", "has 2 of at least 3 corners"),
        (SQUARE[:1], "Wall", "has 1 of at least 2 corners"),
        ([SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]], "Free", "crosses itself near (1.50, 1.50)"),
        ([[20.0, 20.0], [21.0, 20.0], [21.0, 21.0]], "Erase", "covers no cell of the map"),
        ([], "Unknown", "has 0 of at least 3 corners"),
    ],
)
def test_a_mistake_is_told_and_its_corners_stay(corners: list[list[float]], kind: str, words: str) -> None:
    draft = a_draft()
    with pytest.raises(UserError) as told:
        draw(draft, corners, kind)
    assert words in str(told.value)
    assert "\n" not in str(told.value)
    assert len(draft.corners) == len(corners)
    assert draft.edits.edits == ()


def test_a_limit_of_nothing_is_told() -> None:
    with pytest.raises(UserError, match="limit"):
        draw(a_draft(), SQUARE, "Speed limit", limit=0.0)


def test_every_step_is_undone(tmp_path: Path) -> None:
    text = "# by hand\n- wall: [[0, 0], [1, 1]]  # a door\n"
    (tmp_path / "edits.yaml").write_text(text)
    draft = a_draft(load_edits(tmp_path / "edits.yaml"))
    draw(draft, SQUARE, "Keep out")
    draft.remove(0)
    assert [edit.kind for edit in draft.edits.edits] == ["keepout"]
    assert "a door" not in draft.edits.text
    draft.undo()
    assert draft.edits.text.startswith(text)
    draft.undo()
    assert draft.edits.text == text
    np.testing.assert_array_equal(draft.corners, SQUARE)
    for left in (3, 2, 1, 0):
        draft.undo()
        assert len(draft.corners) == left
    with pytest.raises(UserError, match="nothing to undo"):
        draft.undo()


def test_a_finished_shape_is_changed_and_undone() -> None:
    draft = a_draft()
    draw(draft, SQUARE, "Free")
    before = draft.edits
    draft.reopen(0)
    assert not draft.edits.edits
    np.testing.assert_array_equal(draft.corners, SQUARE)
    draft.move_corner(2, np.array([3.0, 3.0]))
    draft.finish("free", width=0.0, limit=0.5)
    np.testing.assert_array_equal(draft.edits.edits[0].points, [*SQUARE[:2], [3.0, 3.0], SQUARE[3]])
    for _ in range(3):
        draft.undo()
    assert draft.edits is before


def test_a_shape_is_not_changed_while_another_is_drawn() -> None:
    draft = a_draft()
    draw(draft, SQUARE, "Free")
    draft.add_corner(np.array([5.0, 5.0]))
    with pytest.raises(UserError, match="not finished"):
        draft.reopen(0)
    assert len(draft.edits.edits) == 1
