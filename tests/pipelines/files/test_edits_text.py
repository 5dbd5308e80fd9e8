"""The text of ``edits.yaml`` changed by an entry: all that is not that entry stays."""

import pytest

from racecar.pipelines.files.edits_text import with_entry, without_entry

TEXT = """# of the whole file
- free: [[0, 0], [1, 0], [1, 1]]  # the chair

# the glass door
- wall: [[0, 0], [5, 0]]
  width: 0.1
- keepout: [[6, 0], [8, 0],
            [8, 2]]
"""
NEW = "- wall: [[1.0, 1.0], [2.0, 2.0]]\n"


@pytest.mark.parametrize("text", [TEXT, TEXT.rstrip(), "# nothing yet\n", ""])
def test_an_entry_comes_last(text: str) -> None:
    assert with_entry(text, NEW) == (f"{text.rstrip()}\n{NEW}" if text else NEW)


def test_an_entry_goes_with_the_comment_above_it_and_the_file_keeps_its_own() -> None:
    assert without_entry(TEXT, 0) == "# of the whole file\n" + TEXT[TEXT.index("# the glass") :]
    assert without_entry(TEXT, 1) == TEXT.replace(
        TEXT[TEXT.index("# the glass") : TEXT.index("- keepout")], ""
    )
    assert without_entry(TEXT, 2) == TEXT[: TEXT.index("- keepout")]


@pytest.mark.parametrize("number", [0, 1, 2])
def test_what_was_added_is_removed_without_a_trace(number: int) -> None:
    shorter = without_entry(TEXT, number)
    assert without_entry(with_entry(shorter, NEW), 2) == shorter


@pytest.mark.parametrize(
    "text",
    ["[{wall: [[0, 0], [1, 1]]}, {wall: [[0, 0], [1, 1]]}]", "- wall: &a [[0, 0], [1, 1]]\n- free: *a\n"],
)
def test_a_text_of_another_form_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"lines of their own|not valid YAML"):
        without_entry(text, 0)
