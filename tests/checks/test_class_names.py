"""A class name means one thing in the whole project."""

import ast
from collections import Counter

from tests.checks.english import REPOSITORY, ROOMS


def test_public_class_names_are_unique() -> None:
    names = Counter(
        node.name
        for room in ROOMS
        for path in (REPOSITORY / room).rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert len(names) > 100
    assert [name for name, count in names.items() if count > 1] == []
