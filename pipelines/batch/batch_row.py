"""What became of a bag of a batch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from racecar.pipelines.files.report import read_report
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
    quality = _section(report, "quality")
    if "verdict" not in quality:
        return BatchRow(
            job,
            Outcome.FAILED,
            f"Its report is not in {job.out}; a cluster's machines must all see this folder under this name.",
        )
    outcome = Outcome(quality["verdict"])
    reasons = quality.get("reasons") or [""]
    return BatchRow(
        job,
        outcome,
        reason="" if outcome == Outcome.GOOD else reasons[0],
        path_m=_section(report, "result").get("path_metres"),
        log_seconds=_section(report, "result").get("log_seconds"),
        error_per_10_m=quality.get("error_per_10_m"),
        error_of_whole_m=quality.get("error_of_whole_m"),
        residual_m=_section(report, "consistency", "scan_matching").get("mean_residual_m"),
        loop_closures=_section(report, "counts").get("loop_closures"),
        seconds=_section(report, "stages", "total").get("wall_seconds"),
        warnings=report.get("warnings", []),
    )


def _section(report: Mapping[str, Any], *names: str) -> Mapping[str, Any]:
    """A part of a report; empty where there is none."""
    part: Any = report
    for name in names:
        part = part.get(name, {}) if isinstance(part, Mapping) else {}
    return part if isinstance(part, Mapping) else {}
