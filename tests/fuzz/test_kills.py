"""A few kills on every run, some dozens with the slow tests; ``make fuzz`` tries 300."""

from functools import partial
from pathlib import Path

import pytest

from racecar.maps.map_files import load_map
from racecar.pipelines.files.edits_file import edits_beside
from tests.fuzz import kills
from tests.fuzz.kills import REPLACEMENTS, Replacement, trial
from tests.fuzz.samples import write_drive
from tests.killed import killed_at


@pytest.fixture
def small_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One short drive, which needs no simulation."""
    home = tmp_path / "inputs"
    home.mkdir()
    write_drive(home / "a.bag")
    (home / "coarse.yaml").write_text(kills.INPUTS["coarse.yaml"])
    monkeypatch.setattr(kills, "_inputs", lambda: home)


@pytest.mark.parametrize("name", ["map", "live map"])
@pytest.mark.usefixtures("small_inputs")
def test_a_killed_command_leaves_one_run(name: str) -> None:
    replacement = Replacement(REPLACEMENTS[name].earlier, REPLACEMENTS[name].new)
    amid_the_moves = replacement.calls - 6
    assert replacement.fault_after(partial(killed_at, amid_the_moves), load_map) == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", REPLACEMENTS)
def test_each_command_is_killed_at_any_moment(name: str) -> None:
    first = list(REPLACEMENTS).index(name)
    numbers = range(first, 10 * len(REPLACEMENTS), len(REPLACEMENTS))
    assert [fault for number in numbers if (fault := trial(number))] == []


def write_both(content: str) -> None:
    for name in ("map.pgm", "map.yaml"):
        Path(name).write_text(content)
        Path(name).rename(Path("out", name))


def test_a_broken_rule_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "out").mkdir()
    monkeypatch.setattr(kills, "_inputs", lambda: tmp_path)
    careless = Replacement(partial(write_both, "old"), partial(write_both, "new"))
    faults = [careless.fault_after(partial(killed_at, call), edits_beside) for call in range(3)]
    assert faults == ["", "other programs see files of both runs", ""]
