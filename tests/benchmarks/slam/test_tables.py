from io import StringIO

from rich.console import Console
from rich.table import Table

from benchmarks.slam.false_loops import FalseLoopFigures
from benchmarks.slam.log_benchmark import LogFigures
from benchmarks.slam.tables import (
    ablation_table,
    accuracy_table,
    false_loops_table,
    stages_table,
)


def figures(translation: float, *, lost: int = 0, stages: dict[str, float] | None = None) -> LogFigures:
    accuracy = {
        "relations": 100,
        "lost": lost,
        "translation_mean_m": translation,
        "translation_std_m": 0.02,
        "rotation_mean_deg": 0.3,
        "rotation_std_deg": 0.4,
    }
    report = {
        "stages": {
            "reading": {"wall_seconds": 1.0},
            "total": {"wall_seconds": 10.0},
        },
        "mapping_seconds": {"matching": 4.0} if stages is None else stages,
        "peak_memory_mb": 512.4,
        "warnings": [],
    }
    return LogFigures(accuracy, report, None)


def rows(table: Table) -> dict[str, list[str]]:
    """The cells of each row by the first one."""
    console = Console(file=StringIO(), width=300)
    console.print(table)
    lines = console.file.getvalue().splitlines()
    cells = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if "|" in line]
    return {row[0]: row[1:] for row in cells}


def test_published_figures_stand_beside_ours_where_there_are_any() -> None:
    shown = rows(accuracy_table({"intel": figures(0.0123), "mine": figures(0.5, lost=7)}))
    ours = ["0.0123 ± 0.0200", "0.300 ± 0.400", "100", "0", "10.0", "512"]
    assert shown["intel"] == [*ours, "0.0229", "0.453", "179", "0.031", "0.070"]
    assert shown["mine"] == ["0.5000 ± 0.0200", *ours[1:3], "7", *ours[4:], *["–"] * 5]


def test_stages_sum_up_to_the_total() -> None:
    shown = rows(stages_table({"a": figures(0.1), "b": figures(0.1, stages={"matching": 2.0, "loops": 5.5})}))
    assert shown["log"] == ["reading", "matching", "loops", "rest", "total"]
    assert shown["a"] == ["1.0", "4.0", "–", "5.0", "10.0"]
    assert shown["b"] == ["1.0", "2.0", "5.5", "1.5", "10.0"]


def test_ablation_has_a_row_for_each_variant() -> None:
    runs = {
        "whole": {"a": figures(0.1), "b": figures(0.2)},
        "less": {"a": figures(0.3), "b": figures(4, lost=2)},
    }
    shown = rows(ablation_table(runs))
    assert shown["variant"] == ["a", "b"]
    assert shown["whole"] == ["0.1000 / 0.300", "0.2000 / 0.300"]
    assert shown["less"] == ["0.3000 / 0.300", "4.0000 / 0.300 (2 lost)"]


def test_false_loops_show_ratios() -> None:
    shown = rows(false_loops_table({"a": FalseLoopFigures(30, 29, 0.02, 0.021, 0.3, 0.36)}))
    assert shown["a"] == ["30", "29", "0.0200", "0.0210", "1.050", "0.300", "0.360", "1.200"]
