"""``racecar experiment``: the experiments of the lab report."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import (
    ConfigOption,
    JsonOption,
    LaserPoseOption,
    OdomTopicOption,
    OutputFolderOption,
    QuietOption,
    ScanTopicOption,
    SeedOption,
)

if TYPE_CHECKING:
    from racecar.pipelines.experiments.recording import BagRecording

_PAGE_WIDTH = 200

QuickOption = Annotated[
    bool, typer.Option("--quick", help="Few repetitions: to see that all works, not to conclude from.")
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on a dask cluster, such as tcp://192.168.0.5:8786; on all cores here when not given.",
        show_default=False,
    ),
]
RecordingOption = Annotated[
    Path | None, typer.Option("--bag", metavar="BAG", help="Also on this recording.", show_default=False)
]
RecordingMapOption = Annotated[
    Path | None,
    typer.Option("--map", metavar="MAP", help="The map of the recording's place.", show_default=False),
]
InitialPoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--initial-pose",
        metavar="X Y YAW",
        help="Where the recording starts, metres and radians of the map; when not given, as the map's "
        "trajectory.tum says if the recording made the map.",
        show_default=False,
    ),
]
EndPoseOption = Annotated[
    str | None,
    typer.Option(
        "--end-pose",
        metavar="'X Y [YAW]'",
        help="Where the recording ends by tape measure, metres and radians of the map.",
        show_default=False,
    ),
]

experiment = typer.Typer(help="Measure the particle filter, as tables and figures for a report.")


@experiment.callback()
def _describe() -> None:
    """Measure the particle filter, as tables and figures for a report.

    Every experiment writes its figures as PNG and SVG, its tables as Markdown and report.json into --out. The
    same seed gives the same figures.
    """


@experiment.command("noise-sweep")
def noise_sweep(
    out: OutputFolderOption,
    quick: QuickOption = False,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """How much motion noise to assume: the car is put from (0, 0, 0) to (1, 1, 0).

    Example: racecar experiment noise-sweep --out runs/noise
    """
    _run(["noise-sweep"], out, quick, scheduler, config, seed, json, quiet)


@experiment.command("autograde")
def autograde(
    out: OutputFolderOption,
    quick: QuickOption = False,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """The deviation from the truth beside that of the course's filter, and the grades for it.

    Example: racecar experiment autograde --out runs/grades
    """
    _run(["autograde"], out, quick, scheduler, config, seed, json, quiet)


@experiment.command("convergence")
def convergence(
    out: OutputFolderOption,
    bag: RecordingOption = None,
    map: RecordingMapOption = None,
    initial_pose: InitialPoseOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    laser_pose: LaserPoseOption = None,
    quick: QuickOption = False,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """How fast a cloud of 0.5 m collapses about the car; with --bag and --map on a recording too.

    Example: racecar experiment convergence --out runs/convergence --bag drive.bag --map runs/drive
    """
    recording = _recording(bag, map, initial_pose, None, scan_topic, odom_topic, laser_pose)
    _run(["convergence"], out, quick, scheduler, config, seed, json, quiet, recording)


@experiment.command("beams-and-particles")
def beams_and_particles(
    out: OutputFolderOption,
    quick: QuickOption = False,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Accuracy and time per update over numbers of beams and particles.

    Example: racecar experiment beams-and-particles --out runs/beams
    """
    _run(["beams-and-particles"], out, quick, scheduler, config, seed, json, quiet)


@experiment.command("motion-model")
def motion_model(
    out: OutputFolderOption,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A picture of what odometry noise makes of the particles.

    Example: racecar experiment motion-model --out runs/pictures
    """
    _run(["motion-model"], out, False, None, config, seed, json, quiet)


@experiment.command("sensor-model")
def sensor_model(out: OutputFolderOption, json: JsonOption = None, quiet: QuietOption = False) -> None:
    """Pictures of the sensor table: as a surface, and a slice with its parts.

    Example: racecar experiment sensor-model --out runs/pictures
    """
    _run(["sensor-model"], out, False, None, None, 0, json, quiet)


@experiment.command("real-run")
def real_run(
    bag: Annotated[
        Path,
        typer.Argument(
            metavar="BAG",
            help="A ROS 1 .bag, a ROS 2 bag folder, or a lone .db3 or .mcap file.",
            show_default=False,
        ),
    ],
    map: Annotated[
        Path,
        typer.Option(
            "--map",
            metavar="MAP",
            help="A map's YAML file, a folder with map.yaml, or a shipped map: building, track.",
            show_default=False,
        ),
    ],
    out: OutputFolderOption,
    initial_pose: InitialPoseOption = None,
    end_pose: EndPoseOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    laser_pose: LaserPoseOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """What can be said of a drive without truth: scans on walls, particles, latency, the end pose.

    Example: racecar experiment real-run drive.bag --map runs/drive --end-pose '3.2 -0.5' --out runs/real
    """
    recording = _recording(bag, map, initial_pose, end_pose, scan_topic, odom_topic, laser_pose)
    _run(["real-run"], out, False, None, config, seed, json, quiet, recording)


@experiment.command("all")
def all_(
    out: OutputFolderOption,
    bag: RecordingOption = None,
    map: RecordingMapOption = None,
    initial_pose: InitialPoseOption = None,
    end_pose: EndPoseOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    laser_pose: LaserPoseOption = None,
    quick: QuickOption = False,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """All experiments, and report.html with every figure, table and what they show.

    Without --bag a simulated drive stands in for a recording.

    Example: racecar experiment all --out runs/report
    """
    recording = _recording(bag, map, initial_pose, end_pose, scan_topic, odom_topic, laser_pose)
    _run(None, out, quick, scheduler, config, seed, json, quiet, recording)


def _recording(
    bag: Path | None,
    map: Path | None,
    initial_pose: tuple[float, float, float] | None,
    end_pose: str | None,
    scan_topic: str | None,
    odom_topic: str | None,
    laser_pose: tuple[float, float, float] | None,
) -> "BagRecording | None":
    from racecar.maps.errors import UserError
    from racecar.pipelines.experiments.recording import BagRecording

    if bag is None and map is None:
        return None
    if bag is None or map is None:
        raise UserError("--bag and --map go together: the recording, and the map of the place it is from.")
    return BagRecording(bag, map, initial_pose, _numbers(end_pose), scan_topic, odom_topic, laser_pose)


def _numbers(text: str | None) -> tuple[float, ...] | None:
    """Two or three numbers, from '3.2 -0.5' or '3.2,-0.5,1.57'."""
    from math import isfinite

    from racecar.maps.errors import UserError

    if text is None:
        return None
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(isfinite(number) for number in numbers):
        raise UserError(f"--end-pose is '{text}'; give x and y in metres and, if measured, yaw in radians.")
    return tuple(numbers)


def _run(
    names: Sequence[str] | None,
    out: Path,
    quick: bool,
    scheduler: str | None,
    config: Path | None,
    seed: int,
    json: Path | None,
    quiet: bool,
    recording: "BagRecording | None" = None,
) -> None:
    """Run experiments by name, or with None all of them and the page about them."""
    from rich.console import Console

    from racecar.maps.whole_files import write_atomically
    from racecar.pipelines.experiments.catalogue import catalogue
    from racecar.pipelines.experiments.html_report import html_report
    from racecar.pipelines.experiments.recording import known_start
    from racecar.pipelines.experiments.result import Finished, Settings
    from racecar.pipelines.experiments.result_files import as_rich, save_result
    from racecar.pipelines.experiments.sweep import Sweep
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report

    settings, sweep = Settings(load_config(config).localization, seed, quick), Sweep(scheduler, quiet)
    report = Report(f"racecar experiment {'all' if names is None else names[0]}")
    report.add("inputs", {"seed": seed, "quick": quick, "settings": settings.localization.model_dump()})
    if recording is not None:
        report.add("inputs", {"bag": recording.bag, "map": recording.map, "end_pose": recording.end_pose})
        recording.load_map()  # what is wrong with it is told now rather than after minutes
        next(recording.messages())
        if names is None or "convergence" in names:
            known_start(recording)
    announce = Console(stderr=True, quiet=quiet, highlight=False)
    page = Console(quiet=quiet, highlight=False, width=None if sys.stdout.isatty() else _PAGE_WIDTH)
    done: dict[str, Finished] = {}
    with output_folder(out) as folder:
        experiments = catalogue(settings, recording)
        for number, name in enumerate(names or experiments, start=1):
            announce.print(f"{number}/{len(names or experiments)} {name}", markup=False)
            with report.stage(name):
                result = experiments[name](settings, sweep)
                done[name] = Finished(result, result.pictures())
                save_result(name, done[name], folder)
            report.add(name, result.figures())
            for table in result.tables():
                page.print(as_rich(table))
        if names is None:
            with write_atomically(folder / "report.html") as partial:
                partial.write_text(html_report(done, settings), encoding="utf-8")
        report.write(folder / "report.json")
    if json is not None:
        report.write(json)
    shown = "report.html" if names is None else f"{done[names[0]].pictures[0].name}.png"
    page.print(f"Look at {out / shown}.", markup=False, soft_wrap=True)
