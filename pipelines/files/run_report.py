"""What report.json says, as far as anything reads it: of a file what is not as it should be is left out, and
told."""

import json
import math
from os.path import realpath
from pathlib import Path
from typing import Any

from pydantic import Field, PrivateAttr

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.text_files import read_text
from racecar.maps.whole_folders import MOVED_LAST, finish_replacing
from racecar.pipelines.files.lenient import Count, Flag, Lenient, Number, Text

REPORT_FILE = MOVED_LAST

_MOST_BYTES = 10_000_000
"""Of a report, since the longest of ours have a hundredth."""
_DEEPEST = 20
"""Levels of nesting, since settings in a report have eight, and what walks through them recurses."""


class PartRead(Lenient):
    """What was read of a bag; seconds."""

    start: Number = 0.0
    duration: Number | None = None

    @property
    def end(self) -> float:
        """Infinite where it was read to its end."""
        return math.inf if self.duration is None else self.start + self.duration


class Inputs(Lenient):
    """What a run was made from."""

    bag: Text | None = None
    bag_fingerprint: Text | None = None
    part: PartRead = PartRead()
    continued: Text | None = Field(default=None, alias="continue")
    map: Text | None = None
    run_digest: Text | None = None

    def is_at_path_of(self, bag: Path) -> bool:
        """Whether the bag was read from there, whatever became of the file."""
        return self.bag is not None and "\0" not in self.bag and realpath(self.bag) == realpath(bag)

    def is_within(self, other: "Inputs") -> bool:
        """Whether all that was read of the bag is known to be in what another run read, by the bag's
        content."""
        is_same_bag = self.bag_fingerprint is not None and self.bag_fingerprint == other.bag_fingerprint
        return is_same_bag and other.part.start <= self.part.start and self.part.end <= other.part.end


class Counts(Lenient):
    """What was read, mended and found."""

    scans: Count | None = None
    loop_closures: Count | None = None
    sessions: Count | None = None
    path_metres: Number | None = None
    interrupted: Flag = False


class Result(Lenient):
    """What came out."""

    path_metres: Number | None = None
    log_seconds: Number | None = None


class Segment(Lenient):
    """A part of a drive that is doubtful, or where the car was not localized."""

    from_s: Number | None = None
    to_s: Number | None = None
    x_m: Number | None = None
    y_m: Number | None = None
    why: Text | None = None
    lost: Flag = False


class Quality(Lenient):
    """The verdict on a map or on a localization."""

    verdict: Text | None = None
    reasons: tuple[Text, ...] = ()
    error_per_10_m: Number | None = None
    error_of_whole_m: Number | None = None
    segments: tuple[Segment, ...] = ()


class Distances(Lenient):
    """Of one trajectory from another, in metres."""

    mean: Number | None = None


class Comparison(Lenient):
    """A trajectory beside another one."""

    absolute_position_m: Distances = Distances()


class Accuracy(Lenient):
    """How scans lie on the map, and how far the poses are from others."""

    against_mapping_trajectory: Comparison = Comparison()
    share_on_walls: Number | None = Field(default=None, alias="share_of_end_points_within_0.10_m_of_a_wall")


class ScanMatching(Lenient):
    """How the matches of scans agree with the solution."""

    mean_residual_m: Number | None = None


class Consistency(Lenient):
    """How the constraints agree with the solution."""

    scan_matching: ScanMatching = ScanMatching()


class UpdateTimes(Lenient):
    """Milliseconds that the localizer took for a scan."""

    mean: Number | None = None
    percentile_99: Number | None = None


class OdometryFaults(Lenient):
    """By what the wheels are wrong."""

    distance: Number = 0.0
    """Share of the distance that they fall short."""


class Stage(Lenient):
    """What a stage cost."""

    wall_seconds: Number | None = None


class Stages(Lenient):
    """What all of it cost."""

    total: Stage = Stage()


class RunReport(Lenient):
    """What the report of a run says, as far as anything that reads it needs; each part keeps the rest."""

    command: Text = "A run"
    inputs: Inputs = Inputs()
    counts: Counts = Counts()
    result: Result = Result()
    quality: Quality = Quality()
    accuracy: Accuracy = Accuracy()
    consistency: Consistency = Consistency()
    update_ms: UpdateTimes = UpdateTimes()
    odometry_faults: OdometryFaults = OdometryFaults()
    stages: Stages = Stages()
    warnings: tuple[Text, ...] = ()

    _damage: str = PrivateAttr("")

    @property
    def damage(self) -> str:
        """A sentence about what had to be left out; empty where it is as it was written."""
        return self._damage

    @property
    def cautions(self) -> list[str]:
        """The warnings, and the damage."""
        return [*self.warnings, *([self.damage] if self.damage else [])]

    def has(self, part: str, field: str) -> bool:
        """Whether a part names a field, whatever it says of it."""
        return field in getattr(self, part).model_fields_set

    def named_map(self) -> OccupancyGrid | None:
        """The map that it names, if that is still there and can be read."""
        try:
            return None if self.inputs.map is None else load_map(self.inputs.map)
        except (UserError, OSError, ValueError):
            return None


def read_report(folder: Path) -> RunReport:
    """The report in a run's folder; an empty one when there is none, as all else can be used without."""
    path = folder / REPORT_FILE
    try:
        finish_replacing(folder)
    except UserError as error:
        return _damaged(RunReport(), str(error))
    if not path.is_file():
        return RunReport()
    faults: list[str] = []
    try:
        contents = json.loads(read_text(path, _MOST_BYTES))
        if not isinstance(contents, dict) or not _is_shallow(contents, _DEEPEST):
            raise ValueError("it is no report")
        report = RunReport.model_validate(contents, context=faults)
    except (UserError, ValueError, RecursionError):
        return _damaged(RunReport(), f"{path} is damaged: nothing of what it says is used.")
    if not faults:
        return report
    names = ", ".join(dict.fromkeys(faults))
    return _damaged(report, f"{path} is damaged: what it says of {names} is left out.")


def _damaged(report: RunReport, sentence: str) -> RunReport:
    report._damage = sentence
    return report


def _is_shallow(value: Any, levels: int) -> bool:
    """Whether lists and mappings are nested no deeper than so many levels."""
    if not isinstance(value, dict | list):
        return True
    items = value.values() if isinstance(value, dict) else value
    return levels > 0 and all(_is_shallow(item, levels - 1) for item in items)
