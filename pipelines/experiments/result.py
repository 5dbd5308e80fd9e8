"""What an experiment gives: figures for people, for programs and for the report."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.figure_style import Picture
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


class ExperimentResult(Protocol):
    """What is known after an experiment."""

    @property
    def title(self) -> str:
        """A headline."""

    def text(self) -> list[str]:
        """Paragraphs: what was done and what came out."""

    def tables(self) -> list[FigureTable]:
        """The figures for people."""

    def figures(self) -> dict[str, Any]:
        """All figures, for a JSON file; those under ``measured_times`` differ from run to run."""

    def pictures(self) -> list[Picture]:
        """The figures to look at."""


@dataclass(frozen=True, eq=False)
class Finished:
    """A result and its pictures, which take a while to draw."""

    result: ExperimentResult
    pictures: list[Picture]


class Experiment(Protocol):
    """Something that can be run."""

    def __call__(self, settings: ExperimentSettings, parallel: ParallelRuns) -> ExperimentResult:
        """Do it."""
