"""Every case in every variant becomes a row, of which tables and the JSON file are made."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import pytest
import typer

from benchmarks.harness.bench import Bench
from benchmarks.harness.command import as_command
from benchmarks.harness.inputs import chosen, recordings_folder
from benchmarks.harness.table import Column, cells, transposed
from benchmarks.harness.variant import replaced
from racecar.maps.errors import UserError
from racecar.pipelines.commands import cli


@dataclass(frozen=True)
class Inner:
    error: Annotated[float, Column("error", ".1f")]
    path: Annotated[float, Column("path", ".0f")]


@dataclass(frozen=True)
class Row:
    error: Annotated[tuple[float, float], Column("error", ".2f")]
    inner: Inner
    shares: Annotated[list[float | None], Column("shares", ".0%")]
    note: str = "for the file only"


ROW = Row((0.5, 0.25), Inner(9.0, 3.0), [0.5, None])


def test_a_row_declares_its_columns() -> None:
    assert cells(ROW) == {"error": "0.50 ± 0.25", "path": "3", "shares": "50% –"}
    assert transposed({"a": {"x": "1", "y": "2"}, "b": {"x": "3"}}) == {
        "x": {"a": "1", "b": "3"},
        "y": {"a": "2", "b": "–"},
    }


def run_once(benchmark: Callable[..., None], *arguments: str) -> int:
    app = typer.Typer()
    app.callback()(lambda: None)
    app.command("tried")(as_command(benchmark))
    return cli.run(["tried", *arguments], app, "tests")


def test_rows_are_measured_announced_shown_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def tried(bench: Bench, times: Annotated[int, typer.Option("--times", min=1)] = 2) -> None:
        """Try."""
        variants = {"once": 1, "more": times, "never": 0}
        rows = bench.cross("rows", [("a", 1.0), ("b", 2.0)], variants, measured)
        each = bench.each("each", {"c": 3.0}, lambda case: measured(case, bench.seed))
        bench.table("All", {**{name: row["more"] for name, row in rows.items()}, **each})

    def measured(case: float, variant: int) -> Row | None:
        return Row((case * variant, 0.0), ROW.inner, []) if variant else None

    path = tmp_path / "figures.json"
    assert run_once(tried, "--times", "3", "--seed", "4", "--json", str(path)) == 0
    shown = capsys.readouterr()
    assert "| b | 6.00 ± 0.00 |" in " ".join(shown.out.split())
    assert "| c | 12.00 ± 0.00 |" in " ".join(shown.out.split())
    assert "rows: b\n  once: error 2.00 ± 0.00, path 3, shares \n" in shown.err
    written = json.loads(path.read_text())
    assert (written["inputs"]["times"], written["inputs"]["seed"]) == (3, 4)
    assert set(written["rows"]["a"]) == {"once", "more"}
    assert written["rows"]["a"]["more"]["error"] == [3.0, 0.0]
    assert written["each"]["c"]["note"] == "for the file only"
    assert run_once(tried, "--times", "0") == 2
    assert run_once(tried, "--quiet") == 0
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "once" not in shown.err


def test_a_part_is_replaced_within_the_block_only() -> None:
    owner: Any = SimpleNamespace(part=1, other=2)
    with pytest.raises(ZeroDivisionError), replaced([(owner, "part", 3), (owner, "part", 4)]):
        assert (owner.part, owner.other) == (4, 2)
        raise ZeroDivisionError
    assert owner.part == 1
    with pytest.raises(KeyError), replaced([(owner, "part", 3), (owner, "missing", 4)]):
        pass
    assert owner == SimpleNamespace(part=1, other=2)


def test_cases_are_chosen_by_name() -> None:
    assert chosen({"a": 1, "b": 2}, None, "case") == {"a": 1, "b": 2}
    assert chosen({"a": 1, "b": 2, "c": 3}, ["c", "a"], "case") == {"a": 1, "c": 3}
    with pytest.raises(UserError, match="no case 'd'; there are: a, b"):
        chosen({"a": 1, "b": 2}, ["d"], "case")


def test_the_environment_names_the_recordings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RACECAR_DATA", str(tmp_path))
    assert recordings_folder() == tmp_path
    assert recordings_folder(tmp_path / "named") == tmp_path / "named"
    monkeypatch.delenv("RACECAR_DATA")
    assert recordings_folder() == Path(__file__).parents[4] / "shared" / "data"
