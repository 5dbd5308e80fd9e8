"""The harness: measures every case in every variant and turns the rows into tables and a JSON file."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, is_dataclass
from functools import partial
from typing import Any, TypeVar

from rich.console import Console

from benchmarks.harness.table import cells, markdown_table
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.other_process import in_fresh_process

_C = TypeVar("_C")
_V = TypeVar("_V")
_R = TypeVar("_R")


class Bench:
    """The input of a benchmark, and the output for its figures."""

    def __init__(
        self, settings: Config, seed: int, report: Report, *, quiet: bool, width: int | None
    ) -> None:
        """Tables are printed ``width`` characters wide; None: as wide as the terminal."""
        self.settings = settings
        self.seed = seed
        self.report = report
        self.quiet = quiet
        self.page = Console(quiet=quiet, highlight=False, width=width)
        self._news = Console(stderr=True, quiet=quiet, highlight=False)
        self._is_warm = False

    def announce(self, sentence: str) -> None:
        """Announce the next action on stderr."""
        self._news.print(sentence, markup=False, soft_wrap=True)

    def cross(
        self,
        section: str,
        cases: Iterable[tuple[str, _C]],
        variants: Mapping[str, _V],
        measure: Callable[[_C, _V], _R | None],
        *,
        in_fresh_processes: bool = False,
    ) -> dict[str, dict[str, _R]]:
        """The row of each case and variant, also written to a section of the JSON file.

        A pair whose measurement is None has no row. Cases may be generated one by one. In a fresh process, to
        which ``measure`` and its arguments are sent, time and memory are what a user would see.
        """
        rows: dict[str, dict[str, _R]] = {}
        for case_name, case in cases:
            self.announce(f"{section}: {case_name}")
            rows[case_name] = {}
            for name, variant in variants.items():
                work = partial(measure, case, variant)
                row = self._in_fresh_process(work) if in_fresh_processes else work()
                if row is not None:
                    rows[case_name][name] = row
                    self.announce(_line(name, row))
            self.report.add(section, {case_name: {name: plain(row) for name, row in rows[case_name].items()}})
        return rows

    def each(
        self,
        section: str,
        cases: Mapping[str, _C],
        measure: Callable[[_C], _R],
        *,
        in_fresh_processes: bool = False,
    ) -> dict[str, _R]:
        """The same for cases without variants."""
        rows = {}
        for name, case in cases.items():
            self.announce(f"{section}: {name}")
            work = partial(measure, case)
            rows[name] = self._in_fresh_process(work) if in_fresh_processes else work()
            self.announce(_line("", rows[name]))
            self.report.add(section, {name: plain(rows[name])})
        return rows

    def table(self, title: str, rows: Mapping[str, Any], caption: str | None = None) -> None:
        """Print rows: dataclasses with `Column`, or their cells by title."""
        self.page.print(markdown_table(title, {name: cells(row) for name, row in rows.items()}, caption))

    def _in_fresh_process(self, work: Callable[[], _R]) -> _R:
        if not self._is_warm:
            from racecar.pipelines.commands.warm_up import warm_up

            self.announce("Compiling the kernels")
            in_fresh_process(warm_up)
            self._is_warm = True
        return in_fresh_process(work)


def plain(row: Any) -> Any:
    """A row for a JSON file."""
    return asdict(row) if is_dataclass(row) and not isinstance(row, type) else row


def _line(name: str, row: Any) -> str:
    """The figures of a row, to show while the table is not finished yet."""
    figures = cells(row) if is_dataclass(row) else {}
    return f"  {name}: " * bool(name) + ", ".join(f"{title} {cell}" for title, cell in figures.items())
