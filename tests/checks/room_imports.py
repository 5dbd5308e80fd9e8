"""Which imports of the tests go up: tests of a room import no room above it, not even through helpers."""

import ast
from collections.abc import Iterator
from pathlib import Path

BELOW = {
    "maps": {"maps"},
    "sensors": {"maps", "sensors"},
    "mapping": {"maps", "sensors", "mapping"},
    "localization": {"maps", "sensors", "localization"},
    "pipelines": {"maps", "sensors", "mapping", "localization", "pipelines"},
    "benchmarks": {"maps", "sensors", "mapping", "localization", "pipelines", "benchmarks"},
}
"""By room, the rooms that its tests may import; other folders of tests may import all."""


def upward_imports(tests: Path) -> Iterator[str]:
    """``file:line: module`` of each, in the folders of a folder of tests that have a room's name."""
    for room, below in BELOW.items():
        for path in sorted((tests / room).rglob("*.py")):
            for line, module in imported_modules(ast.parse(path.read_text())):
                top, *rest = module.split(".")
                part = top if top == "benchmarks" else next(iter(rest), "")
                if top in ("racecar", "tests", "benchmarks") and part and not is_allowed(top, part, below):
                    yield f"{path}:{line}: {module}"


def is_allowed(top: str, part: str, below: set[str]) -> bool:
    """Whether a part of ``racecar`` or ``tests`` is a room below, or holds helpers of all tests."""
    return part in below or (top == "tests" and part not in {*BELOW, "simulated", "end_to_end"})


def imported_modules(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and name of each, also inside functions; ``from a import b`` imports a.b too, if that is one."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names = node.module in ("racecar", "tests")
            yield from (
                (node.lineno, f"{node.module}.{alias.name}" if names else node.module) for alias in node.names
            )
