"""Everything requested from ``racecar map`` for a bag, so that another process can do it and compare it with
earlier results."""

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.runs.bag_reading import BagReading
from racecar.pipelines.runs.output_places import OutputFolder
from racecar.pipelines.runs.run_digest import run_digest

if TYPE_CHECKING:
    from racecar.pipelines.runs.map_run import MapRun
    from racecar.pipelines.runs.run_context import RunContext


@dataclass(frozen=True)
class MappingJob:
    """A bag, the folder for its map, and how to make the map."""

    bag: Path
    out: Path
    config: Config
    config_file: Path | None = None
    """Where the settings come from, for the report."""
    reading: BagReading = field(default_factory=BagReading)
    continued: Path | None = None
    """The folder of the map that is extended."""
    initial_pose: tuple[float, float, float] | None = None
    """Where the drive starts on that map: metres, metres, radians."""
    requested: tuple[str, ...] = ()
    """Optional files to write."""
    record: bool = False
    """Whether the folder ``record`` is written."""

    @property
    def place(self) -> OutputFolder:
        """The folder as an output place."""
        return OutputFolder(self.out, self._written, () if self.continued is None else (self.continued,))

    def _written(self) -> Collection[str]:
        from racecar.pipelines.runs.map_outputs import MAP_NAMES

        return (*MAP_NAMES, *self.requested, *(["record"] if self.record else []))

    def digest(self, bag_fingerprint: str) -> str:
        """Changes whenever a bag with this fingerprint would result in a different map."""
        return run_digest(bag_fingerprint, self.config, self.reading, self.continued, self.initial_pose)


def carry_out(job: MappingJob, context: "RunContext") -> "MapRun":
    """Build the map and write its folder; figures and warnings go into the report. Raises UserError."""
    report = context.report
    report.add("inputs", {"bag": job.bag, "config": job.config_file})
    with output_folder(job.out) as folder, job.reading.open(job.bag, job.config.sensors) as reader:
        with report.stage("loading"):  # after opening the bag, so that its faults are reported at once
            from racecar.pipelines.files.edits_file import MapEdits, edits_beside
            from racecar.pipelines.runs.map_outputs import POINTS_FILE
            from racecar.pipelines.runs.map_run import protect_edits
            from racecar.pipelines.runs.mapping_run import build_map
            from racecar.pipelines.runs.view.recorder import record_mapping
        edits = MapEdits() if job.continued is None else edits_beside(job.continued)
        protect_edits(job.out, edits, job.continued, report)
        run = build_map(
            reader,
            job.config,
            context,
            reading=job.reading,
            continued=job.continued,
            initial_pose=job.initial_pose,
            keep_clouds=POINTS_FILE in job.requested,
        )
        if job.record:
            with report.stage("recording"):
                record_mapping(reader, run.result, folder)
        run.write(folder, job.requested, replaced=job.out)
    return run


def is_done(job: MappingJob) -> bool:
    """Whether the folder holds everything the job would write: the whole map of the current bag."""
    from racecar.pipelines.runs.map_outputs import outputs_with

    report = read_report(job.out)
    if report.damage or report.counts.interrupted:
        return False
    try:
        digest = job.digest(bag_fingerprint(job.bag))
    except (UserError, OSError):
        return False
    names = [name for kind in outputs_with(job.requested) if kind.is_possible for name in kind.files]
    wanted = [*names, "record"] if job.record else names
    return report.inputs.run_digest == digest and all((job.out / name).exists() for name in wanted)
