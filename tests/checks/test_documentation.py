"""README and docs say what is so: their links lead somewhere, and their commands are understood."""

import re
from pathlib import Path
from typing import Any

import pytest
import typer

from tests.checks.documentation import (
    COMMANDS,
    OF_THE_SITE,
    PAGES,
    REPOSITORY,
    blocks,
    broken_links,
    complaint_about,
    mentioned_commands,
    missing_sources,
    shown_commands,
)

ROS_PACKAGE = REPOSITORY / "ros" / "racecar_slam"
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))


def helps(command: Any, name: str) -> dict[str, str]:
    """What each command says of itself."""
    children = getattr(command, "commands", {})
    if not children:
        return {name: command.help}
    return {key: text for each in children for key, text in helps(children[each], f"{name} {each}").items()}


@every_page
def test_links_lead_somewhere(page: Path) -> None:
    assert broken_links(page) == []
    assert missing_sources(page) == []


@every_page
def test_commands_that_are_shown_are_understood(page: Path) -> None:
    complaints = {command: complaint_about(command) for command in shown_commands(page)}
    assert {command: said for command, said in complaints.items() if said} == {}


@every_page
def test_commands_within_sentences_have_the_flags_they_name(page: Path) -> None:
    complaints = {command: complaint_about(command, is_whole=False) for command in mentioned_commands(page)}
    assert {command: said for command, said in complaints.items() if said} == {}


@every_page
def test_python_that_is_shown_compiles(page: Path) -> None:
    for block in blocks(page):
        if block.language == "python":
            compile(block.text, str(page), "exec")


@pytest.mark.parametrize(
    ("name", "text"),
    [each for name, app in COMMANDS.items() for each in helps(typer.main.get_command(app), name).items()],
)
def test_the_examples_of_a_command_are_understood(name: str, text: str) -> None:
    sentences = [line.partition(": ")[2].strip() for line in text.splitlines()]
    examples = [part for each in sentences for part in each.split(" && ") if part.startswith(tuple(COMMANDS))]
    assert any(f"{example} ".startswith(f"{name} ") for example in examples) or name == "racecar live files"
    assert {example: said for example in examples if (said := complaint_about(example))} == {}


def test_the_readme_is_short_and_has_what_a_newcomer_types() -> None:
    text = PAGES[0].read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 200
    assert "make demo" in text
    assert "make test" in text
    assert sum(1 for _ in shown_commands(PAGES[0])) >= 8


def test_the_version_is_the_same_wherever_it_is_written() -> None:
    project = (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8")
    version = re.findall(r'^version = "(.*)"$', project, re.MULTILINE)[0]
    assert f"\nversion: {version}\n" in (REPOSITORY / "CITATION.cff").read_text(encoding="utf-8")
    changes = re.findall(
        r"^## (.*)$", (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert changes[0] == version
    assert f"<version>{version}</version>" in (ROS_PACKAGE / "package.xml").read_text(encoding="utf-8")
    assert f'version="{version}"' in (ROS_PACKAGE / "setup.py").read_text(encoding="utf-8")


def test_the_ros_package_installs_the_files_that_the_command_names() -> None:
    assert {path.name for path in (ROS_PACKAGE / "launch").iterdir()} == {
        path.name for path in (REPOSITORY / "pipelines/live/share").iterdir()
    }
    name = re.findall("<name>(.*)</name>", (ROS_PACKAGE / "package.xml").read_text(encoding="utf-8"))[0]
    assert name == ROS_PACKAGE.name
    assert (ROS_PACKAGE / "resource" / name).is_file()


def test_each_page_of_the_docs_is_in_the_navigation_and_on_the_home_page() -> None:
    navigation = (REPOSITORY / "mkdocs.yml").read_text(encoding="utf-8")
    home = (REPOSITORY / "docs" / "index.md").read_text(encoding="utf-8")
    for page in OF_THE_SITE:
        name = str(page.relative_to(REPOSITORY / "docs"))
        assert f" {name}\n" in navigation
        assert name == "index.md" or f"({name})" in home


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        ("racecar mapp drive.bag", "No such command"),
        ("racecar map drive.bag --out run --crop driven", "--crop"),
        ("racecar map drive.bag", "--out"),
        ("racecar simulate --map building --out a.bag --noise much", "much"),
    ],
)
def test_what_would_be_refused_is_noticed(command: str, complaint: str) -> None:
    said = complaint_about(command)
    assert said is not None
    assert complaint in said


def test_broken_links_are_noticed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A page\n[a](other.md) [b](#a-page) [c](#b) [d](page.md#a-page) `mapping/nothing.py`\n")
    assert broken_links(page) == ["other.md", "#b"]
    assert missing_sources(page) == ["mapping/nothing.py"]


def test_no_node_of_a_diagram_has_the_name_of_a_keyword() -> None:
    for page in OF_THE_SITE:
        for block in blocks(page):
            if block.language == "mermaid":
                nodes = re.findall(r"(?:^|-->)\s*(\w+)", "\n".join(block.text.splitlines()[1:]), re.MULTILINE)
                assert not {"graph", "end", "subgraph", "flowchart", "class", "style"} & set(nodes), page
