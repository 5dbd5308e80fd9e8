"""``edits.yaml``: what it may hold, and one sentence for each mistake."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.files.edits_file import MapEdits, edits_beside, is_made_by_us, load_edits

ALL = """# The chair is gone.
- erase: [[1.0, 2.0], [3.0, 2.0], [3.0, 4.0]]
- wall: [[0, 0], [5, 0]]
  width: 0.1
- wall: [[0, 0], [0, 5], [5, 5]]
- free: [[1, 2], [3, 2], [3, 4]]
- unknown: [[1, 2], [3, 2], [3, 4]]
- keepout: [[1, 2], [3, 2], [3, 4]]
- speed: [[1, 2], [3, 2], [3, 4]]
  limit: 0.5
"""


def edits_of(text: str, folder: Path) -> MapEdits:
    (folder / "edits.yaml").write_text(text)
    return load_edits(folder / "edits.yaml")


def test_every_kind_is_read(tmp_path: Path) -> None:
    edits = edits_of(ALL, tmp_path).edits
    assert [edit.kind for edit in edits] == ["erase", "wall", "wall", "free", "unknown", "keepout", "speed"]
    assert [edit.width for edit in edits if edit.kind == "wall"] == [0.1, 0.0]
    assert edits[-1].limit == 0.5
    np.testing.assert_array_equal(edits[0].points, [[1, 2], [3, 2], [3, 4]])


def test_a_folder_without_the_file_has_no_edits(tmp_path: Path) -> None:
    assert edits_beside(tmp_path).edits == ()
    assert edits_of("# nothing yet\n", tmp_path).edits == ()


def test_in_the_same_frame_the_text_stays_and_in_another_the_edits_move(tmp_path: Path) -> None:
    here = edits_of(ALL, tmp_path)
    assert here.moved(None).text == ALL
    moved = here.moved(np.array([1.0, 2.0, np.pi / 2]))
    np.testing.assert_allclose(moved.edits[1].points, [[1, 2], [1, 7]], atol=1e-12)
    again = edits_of(moved.text, tmp_path)
    for edit, read in zip(moved.edits, again.edits, strict=True):
        np.testing.assert_allclose(read.points, edit.points, atol=1e-4)
        assert (read.kind, read.width, read.limit) == (edit.kind, edit.width, edit.limit)
    assert is_made_by_us(moved.text)
    assert not is_made_by_us(moved.text + "- free: [[1, 2], [3, 2], [3, 4]]\n")
    assert not is_made_by_us(ALL)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("erase: [[0, 0], [1, 0], [1, 1]]", "should hold a list"),
        ("- [1, 2", "cannot be used"),
        ("- wall: [[1, 2], [1, 2]]", "all points of the wall are the same"),
        ("- erase: [[0, 0], [1, 1], [2, 2]]", "the outline of erase has no area; name three corners"),
        ("- {erase: [[0, 0], [1, 0], [1, 1]], free: [[0, 0], [1, 0], [1, 1]]}", "should have one of"),
        ("- chair", "should name what it does"),
        ("- eraze: [[0, 0], [1, 0], [1, 1]]", "did you mean 'erase'"),
        ("- width: 0.1", "unknown key 'width'"),
        ("- free: [[0, 0], [1, 0], [1, 1]]\n  wall: [[0, 0], [1, 0]]", "has wall and free"),
        ("- {}", "has none"),
        ("- free: [[0, 0], [1, 0]]", "needs 3 at least"),
        ("- wall: [[0, 0]]", "needs 2 at least"),
        ("- wall: [[1, 1], [1, 1]]", "are the same"),
        ("- free: [[0, 0], [1, 0, 3], [1, 1]]", "list of points"),
        ("- free: [[0, 0], [1, x], [1, 1]]", "list of points"),
        ("- free: [[0, 0], [1, .nan], [1, 1]]", "list of points"),
        ("- free: room", "list of points"),
        (f"- free: [[0, 0], [1, {'9' * 400}], [1, 1]]", "list of points"),
        ("- free: [[0, 0], [2, 2], [2, 0], [0, 2]]", r"crosses itself near \(1.00, 1.00\)"),
        ("- free: [[0, 0], [1, 1], [2, 2]]", "no area"),
        ("- speed: [[0, 0], [1, 0], [1, 1]]", "limit is missing"),
        ("- speed: [[0, 0], [1, 0], [1, 1]]\n  limit: -1", "limit is -1"),
        ("- wall: [[0, 0], [1, 0]]\n  width: thick", "width is thick"),
        ("- wall: [[0, 0], [1, 0]]\n  limit: 1", "unknown key 'limit'"),
    ],
)
def test_a_mistake_is_one_sentence_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(UserError, match=words) as error:
        edits_of(text, tmp_path)
    told = str(error.value)
    assert "edits.yaml" in told
    assert "\n" not in told


def test_the_second_of_two_edits_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"^Edit 2 in "):
        edits_of("- wall: [[0, 0], [1, 0]]\n- wall: [[0, 0]]\n", tmp_path)
