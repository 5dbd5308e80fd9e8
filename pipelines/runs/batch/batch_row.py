"""The outcome of one bag of a batch."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from racecar.pipelines.files.run_report import RunReport, read_report
from racecar.pipelines.runs.mapping_job import MappingJob


class Outcome(str, Enum):
    """The verdict on the map, or why there is no map."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    WRONG = "wrong"
    FAILED = "failed"
    WAITING = "waiting"

    @property
    def has_map(self) -> bool:
        """Whether the bag was mapped."""
        return self not in (Outcome.FAILED, Outcome.WAITING)


@dataclass(frozen=True)
class BatchRow:
    """A bag, and the figures from its run's report if there is a map."""

    job: MappingJob
    outcome: Outcome
    reason: str = ""
    """Why the map is not good, or why there is no map, in a sentence."""
    report: RunReport = field(default_factory=RunReport)

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return self.job.out.name

    def as_dict(self) -> dict[str, Any]:
        """The row as it is written into reports."""
        report = self.report
        return {
            "bag": self.job.bag,
            "folder": self.name,
            "outcome": self.outcome.value,
            "reason": self.reason,
            "path_metres": report.result.path_metres,
            "log_seconds": report.result.log_seconds,
            "error_per_10_m": report.quality.error_per_10_m,
            "error_of_whole_m": report.quality.error_of_whole_m,
            "mean_residual_m": report.consistency.scan_matching.mean_residual_m,
            "loop_closures": report.counts.loop_closures,
            "seconds": report.stages.total.wall_seconds,
            "warnings": report.cautions,
        }


def mapped_row(job: MappingJob) -> BatchRow:
    """Read the figures of a map from the report in a job's folder."""
    report = read_report(job.out)
    try:
        outcome = Outcome(report.quality.verdict)
    except ValueError:
        missing = (
            f"Its report is not in {job.out}; a cluster's machines must all see this folder under this name."
        )
        return BatchRow(job, Outcome.FAILED, report.damage or missing)
    reason = "" if outcome == Outcome.GOOD else next(iter(report.quality.reasons), "")
    return BatchRow(job, outcome, reason, report)
