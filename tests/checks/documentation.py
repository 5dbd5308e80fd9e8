"""What README and docs claim that can be checked: links, paths, and commands of the project."""

import logging
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from benchmarks.commands import TITLE
from benchmarks.commands import app as benchmarks
from racecar.pipelines.commands.cli import app
from racecar.pipelines.commands.options import join_laser_pose

REPOSITORY = Path(__file__).parents[2]
OF_THE_SITE = tuple(sorted((REPOSITORY / "docs").rglob("*.md")))
PAGES = (
    *(REPOSITORY / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")),
    REPOSITORY / ".github" / "ISSUE_TEMPLATE" / "bug.md",
    *OF_THE_SITE,
)
_FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_SPAN = re.compile(r"`([^`]+)`")
_SOURCE = re.compile(r"(?:mapping|localization|maps|pipelines|benchmarks|tests|racecar)/[\w./]+")
_ACTING = {"--help", "-h", "--version", "--install-completion", "--show-completion"}
"""Flags that act as soon as they are parsed: one of them writes into the settings of the shell."""
COMMANDS = {"racecar": app, TITLE: benchmarks}
"""By the words that they begin with."""
_BEGINNINGS = tuple(f"{name} " for name in COMMANDS)
_SUBSHELL = re.compile(r"\$\((racecar [^)]*)\)")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page."""
    return [Block(*found.groups()) for found in _FENCE.finditer(page.read_text(encoding="utf-8"))]


def prose(page: Path) -> str:
    """A page without its fenced blocks."""
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def broken_links(page: Path) -> list[str]:
    """Relative links of a page to what is not there, a heading included."""
    return [
        link
        for link in _LINK.findall(prose(page))
        if "://" not in link and not _leads_somewhere(page, *link.partition("#")[::2])
    ]


def _leads_somewhere(page: Path, path: str, anchor: str) -> bool:
    target = (page.parent / path) if path else page
    return target.exists() and (not anchor or anchor in _anchors(target))


def _anchors(page: Path) -> set[str]:
    """As GitHub and mkdocs make them of headings."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"\s+", "-", re.sub(r"[^\w\s-]", "", each).strip().lower()) for each in headings}


def missing_sources(page: Path) -> list[str]:
    """Files and folders of the repository that a page names and that are not there."""
    named = (found for span in _SPAN.findall(prose(page)) if (found := _SOURCE.fullmatch(span)))
    return [found[0] for found in named if not (REPOSITORY / found[0]).exists()]


def shown_commands(page: Path) -> Iterator[str]:
    """The lines of a page's shell blocks, and commands of XML blocks, that are ours."""
    for block in blocks(page):
        if block.language == "sh":
            lines = [line.split(" && ") for line in block.text.replace("\\\n", " ").splitlines()]
            for command in (part.strip() for line in lines for part in line):
                yield from _SUBSHELL.findall(command)
                if command.removeprefix(".venv/bin/").startswith(_BEGINNINGS):
                    yield command.removeprefix(".venv/bin/")
        elif block.language == "xml":
            for command in re.findall(r'cmd="(racecar [^"]*)"', block.text):
                yield re.sub(r"\$\(var (\w+)\)", r"\1", command)


def mentioned_commands(page: Path) -> Iterator[str]:
    """Commands within a page's sentences, which may be cut short."""
    return (span for span in _SPAN.findall(prose(page)) if span.startswith(_BEGINNINGS))


def complaint_about(command: str, *, is_whole: bool = True) -> str | None:
    """Why the command line would refuse a command; one that is not whole may lack arguments."""
    name = next(name for name in COMMANDS if command.startswith(name))
    words = shlex.split(command.removeprefix(name).partition(" > ")[0], comments=True)
    log = logging.getLogger("racecar")
    level = log.level  # which --quiet changes as soon as it is parsed
    try:
        _parse(typer.main.get_command(COMMANDS[name]), join_laser_pose(words), is_whole)
    except Exception as error:  # typer's usage errors, whose class moved between its releases
        if not hasattr(error, "format_message"):
            raise
        return str(error.format_message())
    finally:
        log.setLevel(level)
    return None


def _parse(command: Any, words: list[str], is_whole: bool) -> None:
    if set(words) & _ACTING:
        return
    if hasattr(command, "commands"):
        if words or is_whole:
            _, child, rest = command.resolve_command(command.make_context("racecar", list(words)), words)
            _parse(child, rest, is_whole)
        return
    if is_whole:
        command.make_context(command.name, list(words))
        return
    known = {flag for each in command.params for flag in (*each.opts, *each.secondary_opts)}
    for word in words:
        if word.startswith("--") and word not in known:
            command.make_context(command.name, [word])  # it refuses, in its own words
