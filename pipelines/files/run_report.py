"""The parts of report.json that are read back; invalid values in a file are ignored and reported."""

import json
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
"""Largest report in bytes; the longest that this program writes have a hundredth."""
_DEEPEST = 20
"""Levels of nesting. Settings in a report have eight, and code that walks through them recurses."""


class Inputs(Lenient):
    """What a run was made from."""

    bag: Text | None = None
    bag_fingerprint: Text | None = None
    continued: Text | None = Field(default=None, alias="continue")
    map: Text | None = None
    run_digest: Text | None = None

    def is_at_path_of(self, bag: Path) -> bool:
        """Whether the bag was read from this path, whatever happened to the file since."""
        return self.bag is not None and "\0" not in self.bag and realpath(self.bag) == realpath(bag)


class Counts(Lenient):
    """What was read, corrected and found."""

    scans: Count | None = None
    loop_closures: Count | None = None
    sessions: Count | None = None
    path_metres: Number | None = None
    interrupted: Flag = False


class Result(Lenient):
    """What a run produced."""

    path_metres: Number | None = None
    log_seconds: Number | None = None


class Segment(Lenient):
    """A part of a drive that is doubtful, or in which the car was not localized."""

    from_s: Number | None = None
    to_s: Number | None = None
    x_m: Number | None = None
    y_m: Number | None = None
    why: Text | None = None
    lost: Flag = False


class Quality(Lenient):
    """The verdict on a map or localization."""

    verdict: Text | None = None
    reasons: tuple[Text, ...] = ()
    error_per_10_m: Number | None = None
    error_of_whole_m: Number | None = None
    segments: tuple[Segment, ...] = ()


class Distances(Lenient):
    """Distances of one trajectory from another, in metres."""

    mean: Number | None = None


class Comparison(Lenient):
    """Comparison of a trajectory with another one."""

    absolute_position_m: Distances = Distances()


class Accuracy(Lenient):
    """How well scans fit the map, and how far the poses are from others."""

    against_mapping_trajectory: Comparison = Comparison()
    share_on_walls: Number | None = Field(default=None, alias="share_of_end_points_within_0.10_m_of_a_wall")


class ScanMatching(Lenient):
    """How well scan matches agree with the solution."""

    mean_residual_m: Number | None = None


class Consistency(Lenient):
    """How well constraints agree with the solution."""

    scan_matching: ScanMatching = ScanMatching()


class UpdateTimes(Lenient):
    """Milliseconds that the localizer took per scan."""

    mean: Number | None = None
    percentile_99: Number | None = None


class OdometryFaults(Lenient):
    """Errors of the wheel odometry."""

    distance: Number = 0.0
    """Share of the distance that they fall short."""


class Stage(Lenient):
    """Cost of a stage."""

    wall_seconds: Number | None = None


class Stages(Lenient):
    """Cost of all stages."""

    total: Stage = Stage()


class RunReport(Lenient):
    """The report of a run, with the fields that are read back; each part keeps the rest."""

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
    files: dict[Text, Text] = Field(default_factory=dict)
    """Digests of the files in its folder, by name."""

    _damage: str = PrivateAttr("")

    @property
    def damage(self) -> str:
        """A sentence about what had to be ignored; empty if the file is valid."""
        return self._damage

    @property
    def cautions(self) -> list[str]:
        """The warnings, and the damage."""
        return [*self.warnings, *([self.damage] if self.damage else [])]

    def named_map(self) -> OccupancyGrid | None:
        """The map named in the report, if it still exists and can be read."""
        try:
            return None if self.inputs.map is None else load_map(self.inputs.map)
        except (UserError, OSError, ValueError):
            return None


def read_report(folder: Path) -> RunReport:
    """The report in a run's folder. Empty if there is none, since everything else can be used without it."""
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
    """Whether lists and mappings are nested at most ``levels`` deep."""
    if not isinstance(value, dict | list):
        return True
    items = value.values() if isinstance(value, dict) else value
    return levels > 0 and all(_is_shallow(item, levels - 1) for item in items)
