"""The interface of an experiment."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.page import Page
from racecar.pipelines.experiments.recording import Recording
from racecar.pipelines.runs.parallel_runs import ParallelRuns


@dataclass(frozen=True)
class ExperimentSettings:
    """The inputs of every experiment."""

    localization: LocalizationConfig
    seed: int
    quick: bool
    """Fewer repetitions and shorter drives: to check that everything works, not to draw conclusions."""
    recording: Recording | None = None
    """The user's own."""


Experiment: TypeAlias = Callable[[ExperimentSettings, ParallelRuns], Page]
"""Measures, and returns a page with the results."""
