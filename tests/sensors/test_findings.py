"""Every finding that the code names has its sentence, and every sentence its finding."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest

from racecar.sensors.findings import Finding
from racecar.sensors.grades import GRADES, Grade
from racecar.sensors.sentences import SENTENCES, by_name

ROOMS = [Path(__file__).parents[3] / "pipelines" / room for room in ("bags", "live", "runs")]


def named() -> Iterator[tuple[str, set[str] | None]]:
    """Of each finding in the code its name, and those of its numbers where they all stand there."""
    for path in (path for room in ROOMS for path in room.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and _called(node) in ("Finding", "_find", "_leave_out"):
                numbers = {each.arg for each in node.keywords} - {"spoils_map"}
                for name in ast.walk(node.args[0]):
                    if isinstance(name, ast.Constant) and name.value in SENTENCES:
                        yield name.value, None if None in numbers else {each for each in numbers if each}


def _called(node: ast.Call) -> str:
    return str(getattr(node.func, "id", getattr(node.func, "attr", "")))


NAMED = list(named())


@pytest.mark.parametrize("name", [name for name, words in SENTENCES.items() if not callable(words)])
def test_the_numbers_of_a_finding_are_those_of_its_sentence(name: str) -> None:
    words = SENTENCES[name]
    assert not callable(words)
    asked = {field for part in words for _, field, _, _ in Formatter().parse(part) if field}
    assert words[0] and all(given is None or given == asked for each, given in NAMED if each == name)


def test_a_finding_tells_what_is_wrong_and_what_to_do() -> None:
    finding = Finding("odometry_jumps", spoils_map=True, times="twice")
    assert finding.sentence == f"{finding.what} {finding.remedy}"
    assert finding.what == "The odometry jumps twice, faster than any car."
    assert finding.as_dict() == {
        "name": "odometry_jumps",
        "what": finding.what,
        "remedy": finding.remedy,
        "grade": "spoils the map",
        "spoils_map": True,
    }


def test_each_finding_has_a_grade() -> None:
    assert set(GRADES) <= set(SENTENCES)
    assert Finding("odometry_lags").grade is Grade.CORRECTED
    assert Finding("laser_of_several").grade is Grade.FINE
    assert Finding("no_odometry").grade is Grade.MAY_SPOIL_MAP
    assert Finding("clocks_apart", spoils_map=True).grade is Grade.SPOILS_MAP


@pytest.mark.parametrize("name", [name for name, words in SENTENCES.items() if not callable(words)])
def test_a_remedy_is_not_that_there_is_nothing_to_do(name: str) -> None:
    assert "action is needed" not in SENTENCES[name][1]  # type: ignore[index]


def test_what_a_flag_gives_is_named_as_a_parameter_too() -> None:
    """Notebooks and nodes tell the same sentences as commands; `--anew` is of nodes alone."""
    words = [" ".join(each) for each in SENTENCES.values() if not callable(each)]
    flags = {(flag, text) for text in words for flag in re.findall(r"--([a-z-]+)", text) if flag != "anew"}
    assert len(flags) >= 10
    assert all(by_name(flag.replace("-", "_")) in text for flag, text in flags)
