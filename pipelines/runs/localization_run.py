"""Localize a bag on a map: ``racecar.localize_bag`` of Python, and ``racecar localize``."""

import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveQuality, DriveVerdict
from racecar.localization.warm_up import warm_up
from racecar.mapping.session.recordings import Recording
from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import as_pose
from racecar.maps.geometry.se2 import IDENTITY, Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.config_file import Config, ConfigSource, load_config
from racecar.pipelines.files.optional_packages import is_installed, left_out
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.pictures.moments import Moment, MomentsAlong
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_html import run_html
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.bag_reading import BagReading, opened_bag
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.pipelines.runs.evaluation.wall_fit import WallFit
from racecar.pipelines.runs.map_cautions import (
    cautions_of_fit,
    cautions_of_path,
    cautions_of_resolution,
    cautions_of_walls,
)
from racecar.pipelines.runs.map_run import MapRun
from racecar.pipelines.runs.mapping_drive import MappingDrive
from racecar.pipelines.runs.output_places import OutputFolder, check_saving
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.view.recorder import Recorder, recording
from racecar.sensors.findings import times
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from racecar.pipelines.files.pictures.figure_files import NewFigure

LOCALIZATION_FILES = ("trajectory.tum", "overlay.png", REPORT_FILE)

_CONVERGED = 0.2
"""Standard deviation in metres below which the pose counts as found."""
_MOMENTS = 6
"""Number of scans drawn over the map: two or three rows of panels."""
_SAME_TIME = 1_000_000_000
"""Maximum nanoseconds from the first scan to a pose of the mapping trajectory. Chosen by judgement, since the
mapper skips scans before the first odometry."""


@dataclass(eq=False)
class LocalizationRun:
    """The car's poses on a map, and how reliable they are."""

    grid: OccupancyGrid
    """The map."""
    report: Report
    """The contents of report.json."""
    title: str
    """The bag's name."""
    judge: DriveJudge = field(default_factory=DriveJudge)
    estimates: list[PoseEstimate] = field(default_factory=list)
    """The pose with its covariance (3, 3) at each scan."""
    shares_on_wall: list[float] = field(default_factory=list)
    """Share of each scan's end points on a wall."""
    update_seconds: list[float] = field(default_factory=list)
    """Computing time for each scan."""
    along: MomentsAlong = field(default_factory=lambda: MomentsAlong(_MOMENTS))
    """Scans to be drawn over the map."""
    reference: Trajectory | None = None
    """The mapper's trajectory, if this bag made the map."""

    @property
    def trajectory(self) -> Trajectory:
        """The car at each scan: ``stamps`` (N,) in nanoseconds, ``map_from_base`` (N, 3) in metres, metres
        and radians. Scans out of order, which repeat a pose, are left out."""
        stamps = np.array([estimate.stamp for estimate in self.estimates], dtype=np.int64)
        poses = np.array([estimate.map_from_base for estimate in self.estimates])
        newest = np.maximum.accumulate(stamps)
        is_new = np.append(True, stamps[1:] > newest[:-1])
        return Trajectory(stamps[is_new], poses[is_new])

    @property
    def quality(self) -> DriveQuality:
        """The verdict (localized, uncertain or lost), and the reasons."""
        return self.judge.quality

    @property
    def warnings(self) -> list[str]:
        """Faults of the bag and doubts about the poses, one sentence each."""
        return self.report.warnings

    def __repr__(self) -> str:
        return f"<LocalizationRun of {self.title}, {len(self.estimates)} scans. {self.quality.summary}>"

    def _repr_html_(self) -> str:
        return run_html(self.title, self.quality.summary, self.grid, self.trajectory, len(self.warnings))

    @checked
    def plot(self) -> "Figure":
        """The path over the map and scans at a few moments, as in overlay.png.

        A notebook shows the figure by itself, a script with ``matplotlib.pyplot.show()``.
        """
        from racecar.pipelines.files.pictures.figure_files import figure_to_show

        return self._picture(figure_to_show)

    @checked
    def save(self, folder: str | Path, *, replace: bool = False) -> None:
        """Write the files that ``racecar localize`` writes: trajectory.tum, overlay.png and report.json.

        The folder is created; other files in it stay. Raises UserError when it cannot be written to, and when
        it holds results already, unless told to ``replace`` them.
        """
        check_saving(OutputFolder(Path(folder), lambda: LOCALIZATION_FILES), replace=replace)
        with output_folder(Path(folder)) as staging:
            self.write(staging)

    def write(self, folder: Path) -> None:
        """Write every file into an existing folder. Raises UserError when it cannot be written to."""
        report = self.report
        if self.reference is not None and not is_installed("evo"):
            report.warn(left_out("The path was not compared with that of the mapper", "evo"))
        elif self.reference is not None:
            errors = compare(self.trajectory, self.reference, reference_from_map=IDENTITY)
            report.add("accuracy", {"against_mapping_trajectory": errors.summary()})
        with report.stage("writing"):
            save_tum(self.trajectory, folder / "trajectory.tum")
            if is_installed("matplotlib"):
                from racecar.pipelines.files.pictures import figure_files

                picture = self._picture(figure_files.figure_for_file)
                figure_files.save_figure(folder / "overlay.png", picture, figure_files.DOTS_PER_INCH)
            else:
                report.warn(left_out("overlay.png was not drawn", "matplotlib"))
        report.write(folder / REPORT_FILE)

    def _picture(self, new_figure: "NewFigure") -> "Figure":
        from racecar.pipelines.files.pictures.overlay import overlay
        from racecar.pipelines.runs.run_headings import heading

        trajectory = self.trajectory
        recording = Recording(self.title, int(trajectory.stamps[0]), int(trajectory.stamps[-1]))
        said = heading(self.title, self.quality, self.judge.path_metres, [recording])
        return overlay(self.grid, trajectory, self.along.moments, said, new_figure=new_figure)


@checked
def localize_bag(
    bag: str | Path | BagReader,
    map: str | Path | MapRun | OccupancyGrid,
    *,
    initial_pose: ArrayLike | None = None,
    anywhere: bool = False,
    config: ConfigSource = None,
    scan_topic: str | Sequence[str] | None = None,
    odom_topic: str | None = None,
    imu_topic: str | None = None,
    use_odometry: bool = True,
    use_imu: bool = True,
    laser_pose: ArrayLike | None = None,
    start: float = 0.0,
    duration: float | None = None,
    seed: int = 0,
    quiet: bool = True,
) -> LocalizationRun:
    """Estimate where a bag's car was on a map, as ``racecar localize`` does.

    ``bag`` is a path, which is read with the options of `BagReader`, or a `BagReader` that is open. ``map``
    is the run that made it, a folder with map.yaml, a map's YAML file, the name of a shipped map, or a grid.
    The car starts at the ``initial_pose`` (3,), x and y in metres and yaw in radians, or ``anywhere``. With
    neither, the bag that made the map starts at its known pose, and any other bag starts anywhere.
    ``config`` and ``laser_pose`` are as for `map_bag`. Unless ``quiet``, a terminal shows the progress.

    Raises UserError, which states the fault and the remedy in one sentence.
    """
    context, settings = RunContext(Report("racecar.localize_bag"), quiet=quiet), load_config(config)
    reading = BagReading(
        scan_topic, odom_topic, imu_topic, use_odometry, use_imu, laser_pose, start, duration
    )
    with opened_bag(bag, settings.sensors, reading) as reader:
        file = map if isinstance(map, str | Path) else None
        context.report.add("inputs", {"bag": reader.path, "map": file})
        grid, drive = _map_of(map)
        return run_localization(
            reader,
            grid,
            settings,
            context,
            drive=drive,
            initial_pose=None if initial_pose is None else as_pose(initial_pose, "The initial pose"),
            anywhere=anywhere,
            seed=seed,
        )


def _map_of(map: str | Path | MapRun | OccupancyGrid) -> tuple[OccupancyGrid, MappingDrive | None]:
    """The grid, and the drive that made it; of a run, the same as its files hold."""
    if isinstance(map, OccupancyGrid):
        return map, None
    if isinstance(map, MapRun):
        drive = MappingDrive(map.report.contents.inputs, lambda: map.trajectory)
        return map.written_grid, drive if len(map.trajectory) else None
    return load_map(map), MappingDrive.beside(Path(map))


def run_localization(
    reader: BagReader,
    grid: OccupancyGrid,
    config: Config,
    context: RunContext,
    *,
    drive: MappingDrive | None = None,
    initial_pose: Sequence[float] | Pose | None = None,
    anywhere: bool = False,
    seed: int = 0,
    record_into: Path | None = None,
) -> LocalizationRun:
    """Run the localizer on an open bag; figures and warnings go into the report.

    The car starts at the ``initial_pose`` (3,) or ``anywhere``. With neither, it starts where the ``drive``
    that made the map began, if it was this bag's; if that has no pose at the first scan, the whole map is
    searched, and the report says so. A record of all inputs and outputs is written ``record_into`` a folder.
    If the car is not found because the map is of another place, the rest of the bag is skipped. Raises
    UserError when the bag holds no usable scan, or none with a return.
    """
    if initial_pose is not None and anywhere:
        raise UserError("An initial pose and global localization exclude each other; give one of them.")
    if seed < 0:
        raise UserError(f"The seed is {seed}; give 0 or more.")
    report, settings = context.report, config.localization
    report.add("inputs", {"seed": seed, "settings": settings.model_dump()})
    with report.stage("loading"):
        warm_up(settings)
    with report.stage("self-calibration"):
        calibrate(reader, context)
    driven = drive.trajectory() if drive is not None and drive.is_of(reader.path) else None
    for sentence in [] if drive is None else cautions_of_path(grid, drive):
        report.warn(sentence)
    with report.stage("preparing the map"):
        localizer = Localizer(grid, settings, np.random.default_rng(seed))
    if initial_pose is not None:
        localizer.set_pose(np.array(initial_pose, dtype=np.float64))
    is_open = initial_pose is None and not anywhere
    if is_open and driven is None and drive is not None:
        _start_anywhere(report)
    run, walls = LocalizationRun(grid, report, reader.path.name), WallFit(grid)
    with (
        recording(record_into, grid) if record_into else nullcontext() as recorder,
        context.progress("Localizing", reader.message_count) as advance_to,
    ):
        for message in reader:
            if isinstance(message, Scan):
                if is_open and driven is not None and not run.estimates:
                    _start_from(driven, message.stamp, localizer, report)
                with report.stage("localizing"):
                    _add_scan(run, message, localizer)
                with report.stage("judging"):
                    _judge(run, message.stamp, localizer.points_in_base(message), walls)
            else:
                feed(message, localizer)
            if recorder is not None:
                with report.stage("recording"):
                    _record(message, run, localizer, recorder)
            advance_to(reader.messages_read)
            if run.judge.is_hopeless:
                break
    reader.require_returns()
    _describe(run, localizer, reader)
    if run.judge.is_hopeless:
        report.warn(_search_ended(run, is_placed=initial_pose is not None))
    for sentence in [*cautions_of_resolution(grid.resolution), *cautions_of_walls(walls)]:
        report.warn(sentence)
    if driven is not None and _meet(driven, run.trajectory):
        run.reference = driven
    return run


def _start_from(start: Trajectory, stamp: int, localizer: Localizer, report: Report) -> None:
    nearest = int(np.argmin(np.abs(start.stamps - stamp)))
    if abs(int(start.stamps[nearest]) - stamp) > _SAME_TIME:
        _start_anywhere(report, "does not cover the start of the drive")
        return
    report.add("inputs", {"start": start.map_from_base[nearest], "start_source": "the map's trajectory.tum"})
    localizer.set_pose(start.map_from_base[nearest])


def _start_anywhere(report: Report, fault: str = "is from another drive") -> None:
    """Report that the start is unknown, although there is a drive beside the map."""
    report.add("inputs", {"start": "anywhere"})
    report.warn(
        f"The map's trajectory.tum {fault}, so the start was found by global localization; "
        "give the initial pose if it is known."
    )


def _add_scan(run: LocalizationRun, scan: Scan, localizer: Localizer) -> None:
    began = time.perf_counter()
    run.estimates.append(localizer.add_scan(scan))
    run.update_seconds.append(time.perf_counter() - began)
    run.judge.follow(run.estimates[-1])


def _record(message: Measurement, run: LocalizationRun, localizer: Localizer, recorder: Recorder) -> None:
    if isinstance(message, Odometry):
        recorder.write_odometry(message)
    elif isinstance(message, Scan):
        recorder.write_scan(message, run.estimates[-1].map_from_base, run.estimates[-1].covariance)
        recorder.write_particles(message.stamp, *localizer.particles())


def _judge(run: LocalizationRun, stamp: int, points_in_base: NDArray[np.float64], walls: WallFit) -> None:
    """Measure the fit of a scan's points (M, 2) to the walls, and keep a scan now and then along the path."""
    estimate = run.estimates[-1]
    points = transform_points(estimate.map_from_base, points_in_base)
    share = walls.share_of_points(points)
    run.shares_on_wall.append(share)
    moment = Moment(stamp, estimate.map_from_base, points, share)
    run.along.add(run.judge.path_metres, moment, is_known=estimate.is_place_known)


def _describe(run: LocalizationRun, localizer: Localizer, reader: BagReader) -> None:
    report = run.report
    report.add(
        "counts",
        {
            "messages": reader.counts,
            "scans": len(run.estimates),
            "path_metres": run.judge.path_metres,
            "starts": _starts(run),
        },
    )
    report.add("inputs", reader.inputs)
    report.add("quality", run.quality.as_dict())
    report.add("accuracy", _fit(run.shares_on_wall))
    report.add("convergence", _convergence(run.estimates))
    report.add("update_ms", _update_times(run))
    if reader.odom_topic is not None:
        report.add("odometry_faults", asdict(localizer.calibration.faults))
        report.add("laser", {"turned_by": localizer.calibration.laser_turn})
    if reader.imu_topic is not None:
        report.add("gyroscope", localizer.turn_model.figures)
    finding = localizer.turn_model.finding
    contradiction = None if finding is None else finding.warning
    hung = localizer.frozen_odometry.warning(run.estimates[0].stamp)
    is_localized = run.quality.verdict == DriveVerdict.LOCALIZED  # a lost car would learn errors
    learned = localizer.calibration
    faults = (learned.odometry_warning, learned.laser_warning) if is_localized else ()
    told = [sentence for sentence in (contradiction, hung, *faults) if sentence is not None]
    for sentence in [*reader.warnings, *told, *_cautions(run, reader)]:
        report.warn(sentence)


def _fit(shares_on_wall: list[float]) -> dict[str, float]:
    shares = np.array([share for share in shares_on_wall if not np.isnan(share)] or [np.nan])
    return {
        "share_of_end_points_within_0.10_m_of_a_wall": float(np.mean(shares)),
        "share_in_the_worst_tenth_of_scans": float(np.quantile(shares, 0.1)),
    }


def _convergence(estimates: list[PoseEstimate]) -> dict[str, float | None]:
    """When the pose was first found, and its mean standard deviation from then on."""
    deviations = np.array([estimate.deviation for estimate in estimates])
    is_found = (deviations < _CONVERGED) & np.array([estimate.cluster_weight > 0.9 for estimate in estimates])
    if not is_found.any():
        return {"seconds_until_found": None, "mean_deviation_m": float(deviations.mean())}
    first = int(np.argmax(is_found))
    return {
        "seconds_until_found": (estimates[first].stamp - estimates[0].stamp) * 1e-9,
        "mean_deviation_m": float(deviations[first:].mean()),
    }


def _update_times(run: LocalizationRun) -> dict[str, float | None]:
    """Milliseconds per scan, without searches for the start."""
    milliseconds = 1e3 * np.array(run.update_seconds)
    is_start = np.array([estimate.is_start for estimate in run.estimates])
    tracking, searching = milliseconds[~is_start], milliseconds[is_start]
    return {
        "mean": float(np.mean(tracking)) if len(tracking) else None,
        "percentile_99": float(np.quantile(tracking, 0.99)) if len(tracking) else None,
        "longest_search": float(np.max(searching)) if len(searching) else None,
    }


def _search_ended(run: LocalizationRun, *, is_placed: bool) -> str:
    seconds = (run.estimates[-1].stamp - run.estimates[0].stamp) * 1e-9
    start = "correct the initial pose" if is_placed else "give the initial pose"
    return (
        f"The search ended {seconds:.0f} s into the drive, and the rest of the bag was not read. Name the "
        f"map of the place, or {start}."
    )


def _starts(run: LocalizationRun) -> int:
    """Number of global searches; scans without a return do not show where to start."""
    return sum(estimate.is_start and estimate.fit is not None for estimate in run.estimates)


def _cautions(run: LocalizationRun, reader: BagReader) -> list[str]:
    sentences = []
    starts = _starts(run)
    if starts > 1:
        sentences.append(
            f"The pose was searched again {times(starts - 1)}, after gaps in the scans or because they no "
            "longer fitted the map; the path may jump there, which overlay.png shows."
        )
    shares = [share for share in run.shares_on_wall if not np.isnan(share)]
    share = sum(shares) / max(len(shares), 1)
    sentences += cautions_of_fit(share, run.quality.verdict)
    if reader.odom_topic is None and not reader.tells_of_no_odometry:
        sentences.append(
            "No odometry was used: the car's motion was guessed from scan to scan, "
            "which fails along bare corridors and in fast turns."
        )
    return sentences


def _meet(one: Trajectory, other: Trajectory) -> bool:
    """Whether two trajectories overlap in time; two parts of a bag may not."""
    return bool(one.stamps[0] <= other.stamps[-1] and other.stamps[0] <= one.stamps[-1])
