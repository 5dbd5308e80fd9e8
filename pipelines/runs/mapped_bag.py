"""A bag becomes a map in one call: ``racecar.map_bag`` of Python, and the command ``racecar map``."""

import signal
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config, ConfigSource, load_config
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_report import Inputs
from racecar.pipelines.runs.bag_reading import opened_bag
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.edited_folders import edits_of_new_map
from racecar.pipelines.runs.mapping_run import Watch, build_map, nobody_watches, save_mapping
from racecar.pipelines.runs.place_finding import earlier_map
from racecar.pipelines.runs.source_recording import SourceRecording

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class MappedBag:
    """The map of a bag, the path driven, and what both are worth."""

    result: MappingResult
    """All that the mapper knows, with the constraints between keyframes."""
    report: Report
    """The contents of report.json."""
    title: str
    """The bag's name."""
    continued: Path | None = None
    """The folder of the map that this one extends."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map: ``cells`` (rows, columns) in percent occupied, -1 unknown, row 0 at the lowest y;
        ``resolution`` in metres per cell; ``map_from_grid`` (3,), the outer corner of cell (0, 0)."""
        return self.result.grid

    @property
    def trajectory(self) -> Trajectory:
        """The car at each scan: ``stamps`` (N,) in nanoseconds, ``map_from_base`` (N, 3) in metres, metres
        and radians."""
        return self.result.trajectory

    @property
    def quality(self) -> MapQuality:
        """The verdict (good, doubtful or wrong), the expected error, and the reasons."""
        return self.result.quality

    @property
    def warnings(self) -> list[str]:
        """What is wrong with the bag or doubtful about the map, one sentence each."""
        return self.report.warnings

    def __repr__(self) -> str:
        return f"<MappedBag of {self.title}, {len(self.trajectory)} scans. {self.quality.summary}>"

    def plot(self) -> "Figure":
        """The map with the path and the loops closed, as map.png shows it.

        A notebook shows the figure by itself, a script with ``matplotlib.pyplot.show()``.
        """
        from racecar.pipelines.files.pictures.map_picture import figure_to_show, map_picture

        return map_picture(
            self.grid,
            self.trajectory,
            self.result.map_from_keyframe,
            self.result.constraints,
            self.title,
            self.quality.segments,
            caution=self.quality.caution,
            new_figure=figure_to_show,
        )

    def save(self, folder: str | Path) -> None:
        """Write the files that ``racecar map`` writes, such as map.yaml, map.png and trajectory.tum.

        The folder is created; other files in it stay. Raises UserError when it cannot be written to, or when
        it holds edits that would be lost.
        """
        folder = Path(folder)
        with output_folder(folder) as staging:
            self.write(staging, edits_of_new_map(folder, self.continued, self.report))

    def write(self, folder: Path, edits: MapEdits, requested: Collection[str] = ()) -> None:
        """Write every file, and those that are ``requested`` too, into an existing folder.

        Raises UserError when it cannot be written to.
        """
        save_mapping(self.result, self.report, folder, title=self.title, requested=requested, edits=edits)


def map_bag(
    bag: str | Path | BagReader,
    *,
    config: ConfigSource = None,
    continued: str | Path | None = None,
    initial_pose: Sequence[float] | None = None,
    seed: int = 0,
    quiet: bool = True,
) -> MappedBag:
    """Build a map of a bag, as ``racecar map`` does.

    ``bag`` is a path, or a `BagReader` that was opened with the topics, the laser's pose or the part that is
    meant. ``config`` is a YAML file of settings or what it would hold, such as
    ``{"mapping": {"resolution": 0.1}}``. ``continued`` is the folder of an earlier map that is extended; its
    ``initial_pose`` (3,), x and y in metres and yaw in radians, is where the drive starts, else all of that
    map is searched. Without ``quiet`` a terminal shows the progress.

    Raises UserError, with what is wrong and what to do in one sentence.
    """
    settings = load_config(config)
    with opened_bag(bag, settings.sensors) as reader:
        report = Report("racecar.map_bag")
        report.add("inputs", {"bag": reader.path})
        return map_reader(
            reader,
            settings,
            report,
            continued=None if continued is None else Path(continued),
            initial_pose=initial_pose,
            seed=seed,
            quiet=quiet,
        )


def map_reader(
    reader: BagReader,
    config: Config,
    report: Report,
    *,
    continued: Path | None,
    initial_pose: Sequence[float] | None,
    seed: int,
    quiet: bool,
    watch: Watch = nobody_watches,
    stop_signals: Collection[signal.Signals] = (),
) -> MappedBag:
    """Build a map of an open bag; figures and warnings go into the report.

    Whoever wants to ``watch`` sees every scan that is read. The first of the ``stop_signals`` ends the
    reading and what was read becomes the map. Raises UserError.
    """
    report.add("inputs", {"seed": seed, "settings": config.mapping.model_dump()})
    earlier = None
    if continued is not None:
        report.add("inputs", {"continue": continued, "initial_pose": initial_pose})
        earlier = earlier_map(continued, config, seed, initial_pose)
        if SourceRecording(Inputs.model_validate(reader.inputs)).is_within(SourceRecording.of_run(continued)):
            report.warn(
                f"{continued} is of this recording already, which now counts twice: extend it by another "
                "drive."
            )
    elif initial_pose is not None:
        raise UserError(
            "An initial pose is a place on the map that is extended (--continue); give both, or neither."
        )
    with report.stage("self-calibration"):
        calibrate(reader, quiet=quiet)
    result = build_map(
        reader,
        config.mapping,
        report,
        quiet=quiet,
        earlier=earlier,
        watch=watch,
        stop_signals=stop_signals,
    )
    return MappedBag(result, report, reader.path.name, continued)
