"""Lists the module constants of some folders that do not say why they have their value.

``python tests/checks/unexplained_constants.py sensors mapping localization`` ends with 1 when there are any.
A number at the top of a module is followed by a string that names its unit and gives a reason: a physical
one, an equation, a paper, what was measured, or, as in the settings, a judgement with what it rests on. What
a sensor, a robot or a test may want to change is a field of a config instead.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

REASON = re.compile(
    r"\b(because|since|so that|therefore|[Mm]easured|by definition|equation|Eq\.|python -m benchmarks|pytest)"
    r"|\b[Bb]y judgement\b|\(\d{4}\)|, \d{4}\b"
)


def main(folders: list[str]) -> int:
    """Print the constants without a reason; 1 when there are any."""
    files = [path for folder in folders for path in sorted(Path(folder).rglob("*.py"))]
    unexplained = [line for path in files for line in check(path)]
    print(*unexplained, f"{len(unexplained)} constants without a reason", sep="\n")
    return int(bool(unexplained))


def check(path: Path) -> Iterator[str]:
    """``file:line: name`` of each constant without a reason."""
    body = ast.parse(path.read_text()).body
    for statement, after in zip(body, [*body[1:], None], strict=True):
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or not holds_number(statement.value):
            continue
        if not REASON.search(docstring(after)):
            target = statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
            yield f"{path}:{statement.lineno}: {ast.unparse(target)}"


def holds_number(value: ast.expr | None) -> bool:
    """Whether an expression has a number written into it; those that words ask for are none of its value."""
    if value is None or isinstance(value, ast.Lambda | ast.JoinedStr):
        return False
    if isinstance(value, ast.Constant):
        return type(value.value) in (int, float)
    return any(holds_number(part) for part in ast.iter_child_nodes(value) if isinstance(part, ast.expr))


def docstring(statement: ast.stmt | None) -> str:
    """The string that a statement is, if it is one, its white space folded."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return " ".join(str(statement.value.value).split())
    return ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
