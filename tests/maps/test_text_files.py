"""Text and YAML from strangers: values, or one reason, soon and in little memory."""

import os
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.yaml_text import UnreadableYamlError, parse_yaml


def test_lines_of_any_system(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes("ä\r\nb\rc\n".encode())
    assert read_text(tmp_path / "a.txt") == "ä\nb\nc\n"
    assert read_text(str(tmp_path / "a.txt"), 8) == "ä\nb\nc\n"


def test_what_has_no_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").symlink_to("/dev/zero")
    with pytest.raises(UserError, match=r"endless\.yaml is longer than the 0\.1 MB"):
        read_text(tmp_path / "endless.yaml", 100_000)


def test_pipes_are_read_and_never_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "nobody")
    assert read_text(tmp_path / "nobody") == ""
    reading, writing = os.pipe()
    os.write(writing, b"t x y\n")
    os.close(writing)
    assert read_text(f"/dev/fd/{reading}") == "t x y\n"
    os.close(reading)


@pytest.mark.parametrize(("name", "complaint"), [("absent", "no such file"), (".", "is a directory")])
def test_what_cannot_be_read(tmp_path: Path, name: str, complaint: str) -> None:
    with pytest.raises(UserError, match=f"Cannot read .*: {complaint}"):
        read_text(tmp_path / name)


def laughs(levels: int) -> str:
    """A few lines that stand for 10 to the power of ``levels`` values."""
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for level in range(1, levels):
        lines.append(f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 10)}]")
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("a: {b: [1, 2.5, x, true, null]}", {"a": {"b": [1, 2.5, "x", True, None]}}),
        ("a: &x {y: 1}\nb: *x\nc: {<<: *x, z: 2}", {"a": {"y": 1}, "b": {"y": 1}, "c": {"y": 1, "z": 2}}),
        ("a: 1\nb: {a: 2}", {"a": 1, "b": {"a": 2}}),
    ],
)
def test_what_people_write(text: str, value: object) -> None:
    assert parse_yaml(text) == value


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: 1\nb: 2\na: 3", "line 3 gives the key 'a' a second time"),
        ("x: {'a': 1, a: 2}", "line 1 gives the key 'a' a second time"),
        ("x: 2001-99-01", r"line 1 holds a value that cannot be read \(month must be in 1..12\)"),
        ("a: 1\nx: !!int ''", "line 2 holds a value that cannot be read"),
        ("x: !!timestamp q", "line 1 holds a value that cannot be read"),
        (f"x: {'9' * 5000}", "line 1 holds a value that cannot be read"),
        ("[" * 5000, "line 1 is nested more than 40 levels deep"),
        ("{a: " * 5000, "nested more than 40 levels deep"),
        ("- " * 5000, "nested more than 40 levels deep"),
        (laughs(12), "stands for more values"),
        ("a: &a [*a]", "stands for more values"),
        ("&a {a: 1, <<: *a}", "stands for more values"),
        ("a: *b", "line 1 is not valid YAML .found undefined alias 'b'"),
        ("a: [1", "line 1 is not valid YAML"),
        ("? [1]\n: 2", "line 1 is not valid YAML"),
        ("a: \x00", "it is not a YAML text file"),
        ("a: !!python/object:os.system {}", "line 1 is not valid YAML"),
    ],
)
def test_what_is_refused(text: str, reason: str) -> None:
    began = time.process_time()
    with pytest.raises(UnreadableYamlError, match=reason) as caught:
        parse_yaml(text)
    assert "\n" not in str(caught.value)
    assert time.process_time() - began < 5.0


@given(st.text(alphabet="ab:{}[]-&*!<>|?'\" \n0.~#%,", max_size=60))
def test_any_text_is_a_value_or_unreadable(text: str) -> None:
    try:
        parse_yaml(text)
    except UnreadableYamlError as error:
        assert "\n" not in str(error)
