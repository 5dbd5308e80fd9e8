"""What became of a bag of a batch."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.runs.mapping_job import MappingJob


class Outcome(str, Enum):
    """The verdict on the map, or why there is none."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    WRONG = "wrong"
    FAILED = "failed"
    WAITING = "waiting"

    @property
    def has_map(self) -> bool:
        """Whether the bag became a map."""
        return self not in (Outcome.FAILED, Outcome.WAITING)


@dataclass(frozen=True)
class BatchRow:
    """A bag, and the figures of its map as far as there is one; lengths in metres."""

    job: MappingJob
    outcome: Outcome
    reason: str = ""
    """Why the map is not good, or why there is none, in a sentence."""
    path_m: float | None = None
    log_seconds: float | None = None
    """From the first scan to the last."""
    error_per_10_m: float | None = None
    error_of_whole_m: float | None = None
    residual_m: float | None = None
    """Mean distance by which the matches of scans disagree with the solution."""
    loop_closures: int | None = None
    seconds: float | None = None
    """That the mapping took."""
    warnings: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Of the run's folder."""
        return self.job.out.name

    def as_dict(self) -> dict[str, Any]:
        """For reports."""
        return {
            "bag": self.job.bag,
            "folder": self.name,
            "outcome": self.outcome.value,
            "reason": self.reason,
            "path_metres": self.path_m,
            "log_seconds": self.log_seconds,
            "error_per_10_m": self.error_per_10_m,
            "error_of_whole_m": self.error_of_whole_m,
            "mean_residual_m": self.residual_m,
            "loop_closures": self.loop_closures,
            "seconds": self.seconds,
            "warnings": self.warnings,
        }


def mapped_row(job: MappingJob) -> BatchRow:
    """What the report in a job's folder says of its map."""
    report = read_report(job.out)
    quality = report.quality
    try:
        outcome = Outcome(quality.verdict)
    except ValueError:
        missing = (
            f"Its report is not in {job.out}; a cluster's machines must all see this folder under this name."
        )
        return BatchRow(job, Outcome.FAILED, report.damage or missing)
    return BatchRow(
        job,
        outcome,
        reason="" if outcome == Outcome.GOOD else next(iter(quality.reasons), ""),
        path_m=report.result.path_metres,
        log_seconds=report.result.log_seconds,
        error_per_10_m=quality.error_per_10_m,
        error_of_whole_m=quality.error_of_whole_m,
        residual_m=report.consistency.scan_matching.mean_residual_m,
        loop_closures=report.counts.loop_closures,
        seconds=report.stages.total.wall_seconds,
        warnings=report.cautions,
    )
