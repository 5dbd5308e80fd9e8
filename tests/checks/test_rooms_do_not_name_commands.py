"""The algorithms do not know the command line: no text in their rooms names one of its commands.

But for the reasons of constants and settings, which may say with which command a value was measured.
"""

import ast
from pathlib import Path

import pytest

import racecar
from racecar.pipelines.commands.cli import app

ROOT = Path(racecar.__file__).parent
COMMANDS = {
    *(command.name or command.callback.__name__ for command in app.registered_commands if command.callback),
    *(group.name for group in app.registered_groups),
}
MEASURING = {"experiment"}


def texts(path: Path) -> list[tuple[int, str]]:
    """Lines and words of a file's strings and docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [
        (node.lineno, " ".join(node.value.split()))
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]


@pytest.mark.parametrize("room", ["maps", "mapping", "localization"])
def test_a_room_of_algorithms_names_no_command(room: str) -> None:
    assert {"map", "localize", "experiment", "live"} <= COMMANDS
    named = [
        f"{path.relative_to(ROOT)}:{line}: {command}"
        for path in sorted((ROOT / room).rglob("*.py"))
        for line, text in texts(path)
        for command in sorted(COMMANDS - MEASURING)
        if f"racecar {command}" in text and "measured" not in text.lower()
    ]
    assert named == []
