"""What verdicts are worth, as tables."""

from rich.table import Table

from benchmarks.markdown_table import add_columns, new_table
from benchmarks.quality.quality_benchmark import JudgedMap
from benchmarks.quality.verdict_figures import VerdictFigures
from racecar.mapping.quality.map_quality import Verdict


def verdicts_table(figures: VerdictFigures) -> Table:
    """A row for each kind of map, a column for each verdict."""
    table = new_table(
        "Maps by what they are and what the verdict says",
        "good: at most 0.1 m off per 10 m of path and 0.5 m over all of it, with the settings' defaults; "
        "wrong: three times as much",
    )
    add_columns(table, "map is", *(f"called {verdict.value}" for verdict in Verdict))
    for kind, counts in figures.counts.items():
        table.add_row(kind, *(str(counts[verdict.value]) for verdict in Verdict))
    return table


def figures_table(figures: VerdictFigures) -> Table:
    """A row for each figure."""
    table = new_table(
        "What the verdict is worth",
        "by chance: the one error of all maps that fits most; share of all places in wrong maps",
    )
    add_columns(table, "figure", "measured", "by chance")
    for name, share, chance in (
        ("wrong maps called good", figures.wrong_called_good, None),
        ("good maps called wrong", figures.good_called_wrong, None),
        ("maps called doubtful", figures.doubtful, None),
        (
            "error per 10 m expected within a factor of 2",
            figures.local_within_2,
            figures.local_within_2_by_constant,
        ),
        ("error over all of the map, likewise", figures.whole_within_2, figures.whole_within_2_by_constant),
        (
            "wrong maps with a place named within 10 m of the worst error",
            figures.place_found,
            figures.place_found_by_chance,
        ),
    ):
        table.add_row(name, f"{share:.1%}", "" if chance is None else f"{chance:.1%}")
    table.add_row("longest judgement", f"{figures.judging_seconds:.2f} s", "")
    return table


def one_line(judged: JudgedMap) -> str:
    """A map's errors and verdict, for who waits for the table."""
    errors = judged.errors
    return (
        f"{judged.drive}, {judged.spoiling}: {judged.verdict}, expected {judged.expected_local_m:.2f} m per "
        f"10 m and {judged.expected_whole_m:.2f} m over all; is {errors.local_m:.2f} m and "
        f"{errors.whole_m:.2f} m on {errors.path_m:.0f} m"
    )
