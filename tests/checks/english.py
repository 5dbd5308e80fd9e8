"""The texts that users and developers read, and phrases that no reader of English would write there."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

REPOSITORY = Path(__file__).parents[2]
ROOMS = ("maps", "sensors", "mapping", "localization", "pipelines", "benchmarks")
PHRASES = (
    # reports, says, shows or is known: what is not a person tells nothing
    r"\b(nothing|nobody|scans|wheels|walls|motion|odometry) tells?\b",
    r"\b(is|are|was|were) told\b",
    r"\btold as\b",
    r"\btells of\b|\band tells?\b",
    r"\btells? the (way|motion|distance)\b",
    r"\bthat is said\b|\bsaid of\b",
    # distance, or path
    r"\bno way is\b",
    r"\b(how much|nothing|half) of the way\b",
    r"\bthe way (proves|is longer)\b",
    # is not a, cannot
    r"\b(is|are) no (place|path|polygon|rotation|rosbag|radians|file of|place for)\b",
    r"\bwhich cannot be\b",
    # searched for, starts again, corrected, without effect
    r"\bsought\b",
    r"\b(begin|begins|began|begun) (it )?anew\b",
    r"(?<![`/])(?<!racecar )\bmend(s|ed|ing)?\b",
    r"\bin vain\b",
    r"\bleft aside\b|\b(leave|leaves) [\w' ]*\baside\b",
    r"\b(carry|carries|carried) on the map\b|\bmap to carry on\b",
    r"\bsearch (is|was) given up\b",
    # people, someone, anyone
    r"\bpersons\b",
    r"\bsomebody\b|\banybody\b",
    # by default, repeated, at this speed, for this long
    r"\bwhen not given\b",
    r"\bgiven again\.",
    r"\bmade when missing\b",
    r"\bso (long|many) of (each|the)\b",
    r"\bso many times as\b",
    r"\btimes as fast as it was\b",
    # arrive
    r"\b(comes?|has come|have come) on\b",
    r"\bmap has come\b",
    # one voice in what to do: make sure, find out, make it
    r"(?-i:\bSee|[;:,] see) (that|why)\b",
    r"\bLet (the|its|one|it)\b[\w' ]*\b(publish|give|integrate|stamp|state|set|turn)\b",
    r"\bworth mending\b|\bworth a word\b",
    # set phrases that are none
    r"\bas they come\b",
    r"\bbears? the stamp\b",
    r"\bfor which [\w ]* stands in\b",
    r"\bhands its scans on\b",
    r"\bto and fro between\b",
    r"\bin the midst of\b",
    r"\bin (its|the) time\b(?! of|s)|\bodometry of their time\b",
    r"\bis elsewhere for\b",
    r"\ball works\b",
    r"\b(is|it|car) put from\b|\bPut \d",
    r"\bone of both\b",
    r"\bwithout the ado\b|\bby and by\b",
    r"\b(is|are) lived with\b",
    r"\bhours are spent\b",
    r"\bhow calm\b|\bunrest\b",
    r"\bdeceives?\b",
    r"\bWhat is in it\b|\bwrong with it\b",
    r"\bbut for measured\b|\bbut for two\b",
)
PHRASES_OF_CODE = (
    # a sentence without a subject: "Samples of", "Number of", "So that" for "Moved last, so that"
    r"\A(of|because|so that|as of)\b",
    r"(?<!chosen )\bby judgement\b",
    # search for, restart, zero, back and forth
    r"\bsee(k|ks|king)\b",
    r"\banew\b",
    r"\bnought\b",
    r"\bhither\b",
    r"\b(is|are) (looked for|searched on|asked for|tried)\b",
    # shows, reports; information, weight, evidence
    r"\btells? (of|how|what|the|by|whether|nothing|it|a|where|which|that|no|people)\b",
    r"\bsays? (of|nothing of)\b|\bknown of\b",
    r"\b(is|are|be) worth\b",
    r"\bspeaks? (for|against)\b",
    r"\b(is|are) believed\b",
    # sees through, correspondence, aligned with, constraint
    r"\blook(s|ed)? through\b",
    r"\b(a|without|no) partners?\b|\bpartners are\b",
    r"\bweighs? a quarter\b",
    r"\blaid on the (walls|lines)\b",
    r"\btied\b",
    # fixed to the robot; the centre of a submap
    r"\b(what|that) moves? along\b",
    r"\bmiddles?\b[\w ]* of (the|a|both) submaps?\b",
    # ``count``, number of, factor, difference, standard deviation in metres
    r"\bso (many|much|few)\b(?! (that|returns|motions))",
    r"\bby (what|how much|how many)\b",
    r"\b(metres|radians) of standard deviation\b",
    # relative to, from 5 m, except for, in time order, snapshot, add a scan
    r"\bseen from (it|them|each|the first|poses)\b",
    r"\bfrom which on\b",
    r"\bbut for (those|two|what|jitter|gaps|loop)\b",
    r"\bin the order of time\b",
    r"\bas it is now\b",
    r"\btakes? in (a|the|by|how)\b",
    r"\bgo(es)? on (about|from|growing)\b",
    r"\bas it does\b|\bas they do\b",
)


def _any_of(phrases: tuple[str, ...]) -> re.Pattern[str]:
    return re.compile("|".join(f"(?:{phrase})" for phrase in phrases), re.IGNORECASE)


_ODD, _ODD_IN_CODE = _any_of(PHRASES), _any_of(PHRASES + PHRASES_OF_CODE)


class Text(NamedTuple):
    """A text that somebody may read."""

    path: Path
    line: int
    words: str


def odd_phrases(words: str, *, in_code: bool = False) -> list[str]:
    """The phrases in a text, or in a docstring or comment, that should not be there."""
    pattern = _ODD_IN_CODE if in_code else _ODD
    return [found[0] for found in pattern.finditer(" ".join(words.split()))]


def texts() -> Iterator[Text]:
    """README and docs, files that are handed out, the strings of the code, and the help of commands."""
    pages = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
    for page in [*pages, *sorted((REPOSITORY / "pipelines/live/share").iterdir())]:
        for number, paragraph in _paragraphs(page.read_text(encoding="utf-8")):
            yield Text(page, number, paragraph)
    for room in ROOMS:
        for path in sorted((REPOSITORY / room).rglob("*.py")):
            yield from _strings(path, with_docstrings=path.parent.name == "commands")


def remarks() -> Iterator[Text]:
    """The docstrings and comments of the code."""
    for room in ROOMS:
        for path in sorted((REPOSITORY / room).rglob("*.py")):
            yield from _docstrings(path)
            yield from _comments(path)


def _docstrings(path: Path) -> Iterator[Text]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield Text(path, node.lineno, str(node.value.value))


def _comments(path: Path) -> Iterator[Text]:
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.COMMENT:
            yield Text(path, token.start[0], token.string)


def _paragraphs(text: str) -> Iterator[tuple[int, str]]:
    number = 1
    for paragraph in text.split("\n\n"):
        yield number, paragraph
        number += paragraph.count("\n") + 2


def _strings(path: Path, *, with_docstrings: bool) -> Iterator[Text]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    inside = {
        id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)
    }
    remarks = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if id(node) in remarks and not (with_docstrings and isinstance(node, ast.Constant)):
            continue
        if isinstance(node, ast.JoinedStr):
            yield Text(path, node.lineno, "".join(_part(part) for part in node.values))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            yield Text(path, node.lineno, node.value)


def _part(part: ast.expr) -> str:
    return str(part.value) if isinstance(part, ast.Constant) else "…"
