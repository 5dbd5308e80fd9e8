"""Names of files are shown as they are."""

import html

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.errors import UserError
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.typed_path import typed_path


@given(st.text())
def test_nothing_of_a_text_is_markup(text: str) -> None:
    assert not set(literal(text)) & set("<>*_`[]{}|\\~$!")


def test_a_name_with_markup_is_shown_as_it_is() -> None:
    name = "<img src=x> *a* _b_ `c` [d](e) {f} &lt;"
    assert html.unescape(literal(name)) == name


@pytest.mark.parametrize(
    ("typed", "meant"), [("'/tmp/a b'", "/tmp/a b"), ("file:///tmp", "/tmp"), (" runs/x \n", "runs/x")]
)
def test_a_path_is_understood_as_it_is_copied(typed: str, meant: str) -> None:
    assert str(typed_path(typed)) == meant


@pytest.mark.parametrize("typed", ["", "  ", "~nobody-of-this-name/a", 300 * "x", "a\0b"])
def test_what_is_no_path_is_told(typed: str) -> None:
    with pytest.raises(UserError, match=r"(cannot be a path|path is empty)"):
        typed_path(typed)
