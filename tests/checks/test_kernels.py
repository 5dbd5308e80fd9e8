"""Compiled loops are called by their own package, which wraps them for others, and by other loops.

A loop can call nothing but loops, so those of another package are no detour around its wrapper. import-linter
has no contract in which each module of a pattern has importers of its own.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.checks.english import REPOSITORY, ROOMS

SHARED = ("racecar.maps.geometry",)
"""Poses, with which every room reckons."""
EXCEPTIONS = {"benchmarks/ablation/mechanisms.py"}
"""It replaces what it turns off."""


def imports_of(path: Path) -> Iterator[str]:
    """Names of the modules that a file imports from."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def package_of(path: Path) -> str:
    parts = path.relative_to(REPOSITORY).parent.parts
    return ".".join(parts if parts[0] == "benchmarks" else ("racecar", *parts))


def test_kernels_are_imported_by_their_own_package_only() -> None:
    strangers, imported = [], 0
    for path in sorted(path for room in ROOMS for path in (REPOSITORY / room).rglob("*.py")):
        if path.stem.endswith("_kernels") or str(path.relative_to(REPOSITORY)) in EXCEPTIONS:
            continue
        for module in sorted({name for name in imports_of(path) if name.endswith("_kernels")}):
            imported += 1
            package = module.rpartition(".")[0]
            if package not in (*SHARED, package_of(path)):
                strangers.append(f"{path.relative_to(REPOSITORY)} imports {module}")
    assert imported > 10
    assert strangers == []
