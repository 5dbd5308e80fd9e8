"""What an experiment is, and what it is given."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.experiments.page import Page
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


Experiment: TypeAlias = Callable[[ExperimentSettings, ParallelRuns], Page]
"""It measures, and tells what came out."""
