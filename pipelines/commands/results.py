"""How a command ends: its figures, a summary of them and of its files, and its exit code."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from racecar.pipelines.commands.options import JsonOption, QuietOption
from racecar.pipelines.commands.terminal import teller

if TYPE_CHECKING:
    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.run_context import RunContext

NOT_GOOD_ENOUGH = 3
"""Exit code with --strict: the command did its work, but the result is not usable."""
INTERRUPTED = 130
"""Exit code of a program ended by Ctrl-C: 128 plus the number of the signal."""
_MOST_NAMES = 12
"""With more files than this, they are counted by kind, to fit on a line or two."""


@dataclass(frozen=True, kw_only=True)
class EndFlags:
    """Where a run's figures go, and whether the command reports its work."""

    json: JsonOption = None
    quiet: QuietOption = False

    def context(self, command: str, **more: Any) -> "RunContext":
        """The context for the run of a command."""
        from racecar.pipelines.files.report import Report
        from racecar.pipelines.runs.run_context import RunContext

        return RunContext(Report(command), quiet=self.quiet, announce=teller(quiet=self.quiet), **more)

    def end(
        self, report: "Report", sentences: Sequence[str], folder: Path, first: str, verdict: str = ""
    ) -> None:
        """Write the figures, and print what was done, the report's warnings, the location of the files, which
        to open ``first``, and the verdict."""
        if self.json is not None:
            report.write(self.json)
        if self.quiet:
            return
        for sentence in sentences:
            print(sentence)
        print_warnings(report.warnings)
        print(where_to_look(folder, first, self.json))
        if verdict:
            print(verdict)


def print_warnings(sentences: Iterable[str]) -> None:
    """One line each, on stderr."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
    for sentence in sentences:
        console.print(f"Warning: {sentence}", style="yellow", markup=False)


def where_to_look(folder: Path, first: str, figures: Path | None = None) -> str:
    """A sentence that names the file to open first, what else was written to the folder, and the ``figures``
    of --json."""
    from racecar.pipelines.files.outputs import written_to

    written = written_to(folder)
    others = [name for name in written if name != first]
    if written and first not in written:  # if a package is missing
        where = f"Written to {folder}: {_listed(others)}."
    else:
        where = f"Look at {folder / first}" + (f"; also in {folder}: {_listed(others)}." if others else ".")
    return where + (f" {where_figures_are(figures)}" if figures else "")


def where_figures_are(path: Path) -> str:
    """A sentence that names the file of --json."""
    return f"The figures are in {path}."


def _listed(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    kinds = Counter(PurePath(name).suffix for name in names)
    counted = [f"{count} {kind} files" for kind, count in kinds.items() if kind and count > 1]
    return ", ".join([*counted, *(name for name in names if kinds[PurePath(name).suffix] == 1)])
