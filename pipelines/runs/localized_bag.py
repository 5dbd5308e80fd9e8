"""A bag is localized on a map in one call: ``racecar.localize_bag`` of Python, and ``racecar localize``."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_quality import DriveQuality
from racecar.localization.warm_up import warm_up
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config, ConfigSource, load_config
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.bag_reading import opened_bag
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.localization_run import (
    LocalizationRun,
    run_localization,
    save_localization,
    start_anywhere,
)
from racecar.pipelines.runs.map_cautions import cautions_of_path
from racecar.pipelines.runs.mapping_drive import has_mapping_drive, mapping_trajectory
from racecar.pipelines.runs.view.recorder import Recorder

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class LocalizedBag:
    """Where the car was on a map, and what the poses are worth."""

    run: LocalizationRun
    """The localizer's answers and their fit to the walls, scan by scan."""
    grid: OccupancyGrid
    """The map."""
    reference: Trajectory | None
    """The path that the mapper found, when the bag is the one that made the map."""
    report: Report
    """The contents of report.json."""
    title: str
    """The bag's name."""

    @property
    def trajectory(self) -> Trajectory:
        """The car at each scan: ``stamps`` (N,) in nanoseconds, ``map_from_base`` (N, 3) in metres, metres
        and radians."""
        return self.run.trajectory

    @property
    def estimates(self) -> list[PoseEstimate]:
        """The pose with its covariance (3, 3) at each scan."""
        return self.run.estimates

    @property
    def quality(self) -> DriveQuality:
        """The verdict (localized, uncertain or lost), and the reasons."""
        return self.run.quality

    @property
    def warnings(self) -> list[str]:
        """What is wrong with the bag or doubtful about the poses, one sentence each."""
        return self.report.warnings

    def __repr__(self) -> str:
        return f"<LocalizedBag of {self.title}, {len(self.estimates)} scans. {self.quality.summary}>"

    def plot(self) -> "Figure":
        """The path over the map and scans at a few moments, as overlay.png shows them.

        A notebook shows the figure by itself, a script with ``matplotlib.pyplot.show()``.
        """
        from racecar.pipelines.files.pictures.map_picture import figure_to_show
        from racecar.pipelines.files.pictures.overlay import overlay

        return overlay(
            self.grid, self.trajectory, self.run.along.moments, self.title, new_figure=figure_to_show
        )

    def save(self, folder: str | Path) -> None:
        """Write the files that ``racecar localize`` writes: trajectory.tum, overlay.png and report.json.

        The folder is created; other files in it stay. Raises UserError when it cannot be written to.
        """
        with output_folder(Path(folder)) as staging:
            self.write(staging)

    def write(self, folder: Path) -> None:
        """Write every file into an existing folder. Raises UserError when it cannot be written to."""
        save_localization(self.run, self.grid, self.reference, self.report, folder, title=self.title)


def localize_bag(
    bag: str | Path | BagReader,
    map: str | Path | OccupancyGrid,
    *,
    initial_pose: Sequence[float] | None = None,
    anywhere: bool = False,
    config: ConfigSource = None,
    seed: int = 0,
    quiet: bool = True,
) -> LocalizedBag:
    """Estimate where a bag's car was on a map, as ``racecar localize`` does.

    ``bag`` is a path, or a `BagReader` that was opened with the topics, the laser's pose or the part that is
    meant. ``map`` is a map's YAML file, a folder with map.yaml, the name of a shipped map, or a grid. The car
    starts at the ``initial_pose`` (3,), x and y in metres and yaw in radians, or ``anywhere``. With neither,
    the bag that made the map starts where it was then, and any other starts anywhere. ``config`` is a YAML
    file of settings or what it would hold. Without ``quiet`` a terminal shows the progress.

    Raises UserError, with what is wrong and what to do in one sentence.
    """
    settings = load_config(config)
    with opened_bag(bag, settings.sensors) as reader:
        report, path = Report("racecar.localize_bag"), None if isinstance(map, OccupancyGrid) else Path(map)
        report.add("inputs", {"bag": reader.path, "map": path})
        return localize_reader(
            reader,
            map if isinstance(map, OccupancyGrid) else load_map(map),
            settings,
            report,
            map_path=path,
            initial_pose=initial_pose,
            anywhere=anywhere,
            seed=seed,
            quiet=quiet,
        )


def localize_reader(
    reader: BagReader,
    grid: OccupancyGrid,
    config: Config,
    report: Report,
    *,
    map_path: Path | None,
    initial_pose: Sequence[float] | None,
    anywhere: bool,
    seed: int,
    quiet: bool,
    record_into: Path | None = None,
) -> LocalizedBag:
    """Localize in an open bag; figures and warnings go into the report.

    The drive that made the map is looked for beside ``map_path``. A record of all that goes in and out is
    written ``record_into`` a folder. Raises UserError.
    """
    if initial_pose is not None and anywhere:
        raise UserError(
            "An initial pose and a search of the whole map (--global) exclude each other; give one of them."
        )
    settings = config.localization
    report.add("inputs", {"seed": seed, "settings": settings.model_dump()})
    with report.stage("loading"):
        warm_up(settings)
    with report.stage("self-calibration"):
        calibrate(reader, quiet=quiet)
    driven = None if map_path is None else mapping_trajectory(map_path, reader.path)
    for sentence in [] if map_path is None else cautions_of_path(grid, map_path):
        report.warn(sentence)
    with report.stage("preparing the map"):
        localizer = Localizer(grid, settings, np.random.default_rng(seed))
    if initial_pose is not None:
        localizer.set_pose(np.array(initial_pose, dtype=np.float64))
    is_open = initial_pose is None and not anywhere
    if is_open and driven is None and map_path is not None and has_mapping_drive(map_path):
        start_anywhere(report)
    with Recorder(record_into, grid) if record_into else nullcontext() as recorder:
        run = run_localization(
            reader,
            localizer,
            grid,
            report,
            start=driven if is_open else None,
            is_placed=initial_pose is not None,
            recorder=recorder,
            quiet=quiet,
        )
    is_same = driven is not None and _meet(driven, run.trajectory)
    return LocalizedBag(run, grid, driven if is_same else None, report, reader.path.name)


def _meet(one: Trajectory, other: Trajectory) -> bool:
    """Whether two trajectories have time in common, as those of two parts of a bag may not."""
    return bool(one.stamps[0] <= other.stamps[-1] and other.stamps[0] <= one.stamps[-1])
