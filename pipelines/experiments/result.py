"""What an experiment is given, and what it gives: figures for people, for programs and for the report."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.experiments.figures import Picture
from racecar.pipelines.experiments.recording import Recording
from racecar.pipelines.runs.parallel_runs import ParallelRuns


@dataclass(frozen=True)
class ExperimentSettings:
    """What every experiment is given."""

    localization: LocalizationConfig
    seed: int
    quick: bool
    """Fewer repetitions and shorter drives: to see that all works, not to draw conclusions from."""
    recording: Recording | None = None
    """Of one's own."""


@dataclass(frozen=True)
class FigureTable:
    """Figures in rows, already written out."""

    title: str
    columns: Sequence[str]
    """With units."""
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, eq=False)
class ExperimentResult:
    """What is known after an experiment."""

    title: str
    """A headline."""
    text: Sequence[str]
    """Paragraphs: what was done and what came out."""
    tables: Sequence[FigureTable]
    """The figures for people."""
    figures: dict[str, Any]
    """All figures, for a JSON file; those under ``measured_times`` differ from run to run."""
    pictures: Sequence[Picture]
    """The figures to look at."""

    def save(self, name: str, folder: Path) -> None:
        """Write the pictures as PNG and SVG and all else as Markdown into an existing folder.

        Raises UserError when the place cannot be written to.
        """
        with write_atomically(folder / f"{name}.md") as partial:
            partial.write_text(self._markdown(), encoding="utf-8")
        for picture in self.pictures:
            for suffix, contents in ((".png", picture.png), (".svg", picture.svg)):
                with write_atomically(folder / f"{picture.name}{suffix}") as partial:
                    partial.write_bytes(contents)

    def _markdown(self) -> str:
        parts = [f"# {self.title}", *self.text]
        for table in self.tables:
            lines = [table.columns, ["---"] * len(table.columns), *table.rows]
            parts += [f"**{table.title}**", "\n".join(f"| {' | '.join(line)} |" for line in lines)]
        parts += [f"![{picture.shows}]({picture.name}.svg)" for picture in self.pictures]
        return "\n\n".join(parts) + "\n"


class Experiment(Protocol):
    """Something that can be run."""

    def __call__(self, settings: ExperimentSettings, parallel: ParallelRuns) -> ExperimentResult:
        """Do it."""


def plus_minus(values: NDArray[np.float64], digits: int) -> str:
    """Mean and standard deviation of those that are finite."""
    known = values[np.isfinite(values)]
    return f"{known.mean():.{digits}f} ± {known.std():.{digits}f}" if len(known) else "–"
