"""Adding and removing entries in the text of ``edits.yaml``, which keeps comments and layout."""

import yaml

from racecar.maps.yaml_text import parse_yaml


def with_entry(text: str, entry: str) -> str:
    """The text of a list with one more entry, which is itself given as the text of a list of one.

    Raises ValueError when the entries of the text do not begin on lines of their own.
    """
    longer = f"{text.rstrip()}\n{entry}" if text.strip() else entry
    return _verified(longer, [*_entries(text), *_entries(entry)])


def without_entry(text: str, number: int) -> str:
    """The text without entry ``number``, from 0, and the comments right above it. Comments above the first
    entry are about the whole file and stay. Raises ValueError as above."""
    lines = text.splitlines(keepends=True)
    first, *others = _first_lines(text)
    starts = [first, *(_with_comments_above(lines, line) for line in others), len(lines)]
    entries = _entries(text)
    shorter = "".join(lines[: starts[number]] + lines[starts[number + 1] :])
    return _verified(shorter, entries[:number] + entries[number + 1 :])


def _verified(text: str, expected: list[object]) -> str:
    if _entries(text) != expected:
        raise ValueError("the text is no list of entries on lines of their own")
    return text


def _entries(text: str) -> list[object]:
    return list(parse_yaml(text) or [])


def _first_lines(text: str) -> list[int]:
    """Lines on which the entries begin."""
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    return [entry.start_mark.line for entry in root.value] if root is not None else []


def _with_comments_above(lines: list[str], line: int) -> int:
    """First line of the comments right above a line."""
    while lines[line - 1].startswith("#"):
        line -= 1
    return line
