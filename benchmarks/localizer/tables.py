"""The checks of the localizer's benchmark as a table in Markdown."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rich.table import Table

from benchmarks.localizer.localizer_benchmark import LocalizerFigures
from benchmarks.markdown_table import add_columns, new_table

_Figure = Callable[[LocalizerFigures], float]


@dataclass(frozen=True)
class Check:
    """A figure that has to reach a bar."""

    name: str
    figure: _Figure
    bar: float
    is_upper: bool
    shape: str = ".2f"

    def holds(self, figures: LocalizerFigures) -> bool:
        """Whether it does."""
        value = self.figure(figures)
        return value <= self.bar if self.is_upper else value >= self.bar

    def as_dict(self, maps: Mapping[str, LocalizerFigures]) -> dict[str, Any]:
        """The bar, and for each map the value and whether it holds."""
        values = {
            name: {"value": self.figure(figures), "holds": self.holds(figures)}
            for name, figures in maps.items()
        }
        return {"bar": self.bar, "at_most": self.is_upper, **values}


CHECKS = (
    Check("full step / bare loads", lambda f: f.loads_ratio, 2.5, True),
    Check("plain filter / full step", lambda f: f.plain_ratio, 40.0, False, ".1f"),
    Check("a spread particle / one of a cloud", lambda f: f.spread_ratio, 3.0, True),
    Check("survey of the map (s)", lambda f: f.survey_seconds, 2.0, True),
    Check("search of the map, one core / both", lambda f: f.search_gain, 1.6, False),
    Check("pace of another thread", lambda f: f.other_thread_pace, 0.8, False),
)

_TIMES: dict[str, _Figure] = {
    "full step (ms)": lambda f: f.step_ms,
    "bare loads (ms)": lambda f: f.loads_ms,
    "plain filter's step (ms)": lambda f: f.plain_step_ms,
    "step beside a busy Python thread (ms)": lambda f: f.step_beside_thread_ms,
    "mean error, this filter (m)": lambda f: f.error_m,
    "mean error, plain filter (m)": lambda f: f.plain_error_m,
}


def checks_table(maps: Mapping[str, LocalizerFigures]) -> Table:
    """Each check's value on each map, its bar, and whether it holds."""
    table = new_table("Speed of the localizer")
    add_columns(table, "check", "bar", *maps, "holds")
    for check in CHECKS:
        bar = f"{'≤' if check.is_upper else '≥'} {check.bar:g}"
        values = (f"{check.figure(figures):{check.shape}}" for figures in maps.values())
        missed = [name for name, figures in maps.items() if not check.holds(figures)]
        table.add_row(check.name, bar, *values, f"no: {', '.join(missed)}" if missed else "yes")
    return table


def times_table(maps: Mapping[str, LocalizerFigures]) -> Table:
    """What the ratios were made from, and where the time of a step goes."""
    table = new_table("Behind it")
    add_columns(table, "figure", *maps)
    for name, figure in _TIMES.items():
        table.add_row(name, *(f"{figure(figures):.3f}" for figures in maps.values()))
    for part in next(iter(maps.values())).step_parts_ms:
        values = (f"{figures.step_parts_ms[part]:.3f}" for figures in maps.values())
        table.add_row(f"of the step: {part} (ms)", *values)
    table.add_row("steps that resampled", *(f"{figures.resampled:.0%}" for figures in maps.values()))
    return table
