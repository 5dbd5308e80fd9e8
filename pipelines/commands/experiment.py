"""``racecar experiment``: a command for each experiment of the catalogue, and one for all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines.commands.options import (
    BagArgument,
    ConfigOption,
    JsonOption,
    LaserPoseOption,
    MapOption,
    OdomTopicOption,
    OutputFolderOption,
    QuietOption,
    ScanTopicOption,
    SchedulerOption,
    SeedOption,
    parse_laser_pose,
)
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.results import where_to_look
from racecar.pipelines.experiments.catalogue import CATALOGUE, ExperimentEntry, Uses

if TYPE_CHECKING:
    from racecar.pipelines.experiments.recording import BagRecording
    from racecar.pipelines.experiments.result import ExperimentSettings

ResultFolderOption = Annotated[
    OutputFolderOption,
    WritesFolder(lambda flags: ("report.json", "report.html", *(f"{entry.name}.md" for entry in CATALOGUE))),
]
QuickOption = Annotated[
    bool,
    typer.Option(
        "--quick", help="Few repetitions: enough to see that everything works, not to draw conclusions."
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
        help="Where the recording starts, metres and radians of the map; by default, as the map's "
        "trajectory.tum says if the recording made the map, else it is searched for.",
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


@dataclass(frozen=True)
class _Flags:
    """What the user gave; where a command lacks a flag, its default."""

    out: Path
    bag: Path | None = None
    map: Path | None = None
    initial_pose: tuple[float, float, float] | None = None
    end_pose: str | None = None
    scan_topic: list[str] | None = None
    odom_topic: str | None = None
    laser_pose: str | None = None
    quick: bool = False
    scheduler: str | None = None
    config: Path | None = None
    seed: int = 0
    json: Path | None = None
    quiet: bool = False


_ANY_RECORDING = Uses.RECORDING | Uses.EXTRA_RECORDING
_FLAGS: tuple[tuple[str, Any, Uses | None], ...] = (
    ("bag", BagArgument, Uses.RECORDING),
    ("map", MapOption, Uses.RECORDING),
    ("out", ResultFolderOption, None),
    ("bag", RecordingOption, Uses.EXTRA_RECORDING),
    ("map", RecordingMapOption, Uses.EXTRA_RECORDING),
    ("initial_pose", InitialPoseOption, _ANY_RECORDING),
    ("end_pose", EndPoseOption, Uses.END_POSE),
    ("scan_topic", ScanTopicOption, _ANY_RECORDING),
    ("odom_topic", OdomTopicOption, _ANY_RECORDING),
    ("laser_pose", LaserPoseOption, _ANY_RECORDING),
    ("quick", QuickOption, Uses.REPETITIONS),
    ("scheduler", SchedulerOption, Uses.REPETITIONS),
    ("config", ConfigOption, Uses.SETTINGS),
    ("seed", SeedOption, Uses.SETTINGS),
    ("json", JsonOption, None),
    ("quiet", QuietOption, None),
)
"""Each flag, how it is parsed and explained, and which uses of an experiment bring it along (None: it is
always there), in the order of the help."""
_REQUIRED = (BagArgument, MapOption, ResultFolderOption)

experiment = typer.Typer(help="Measure the particle filter, as tables and figures for a report.")


@experiment.callback()
def _describe() -> None:
    """Measure the particle filter, as tables and figures for a report.

    Every experiment writes its figures as PNG and SVG, its tables as Markdown and report.json into --out. The
    same seed gives the same figures.
    """


def add_command(
    app: typer.Typer, name: str, uses: Uses, help: str, example: str, entries: Sequence[ExperimentEntry]
) -> None:
    """Add a command to an app that runs some experiments, with the flags for what they use."""

    def command(**flags: Any) -> None:
        _run(name, entries, _Flags(**flags))

    parameters = [
        Parameter(
            flag,
            Parameter.KEYWORD_ONLY,
            annotation=kind,
            default=Parameter.empty if kind in _REQUIRED else getattr(_Flags, flag),
        )
        for flag, kind, brought_by in _FLAGS
        if brought_by is None or brought_by & uses
    ]
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]  # which typer reads
    app.command(name, help=f"{help}\n\nExample: racecar experiment {name} {example}")(command)


for _entry in CATALOGUE:
    add_command(experiment, _entry.name, _entry.uses, _entry.help, _entry.example, [_entry])
add_command(
    experiment,
    "all",
    Uses.SETTINGS | Uses.REPETITIONS | Uses.EXTRA_RECORDING | Uses.END_POSE,
    "All experiments, and report.html with every figure, table and what they show.\n\n"
    "Without --bag a simulated drive stands in for a recording.",
    "--out runs/report",
    CATALOGUE,
)


def _run(name: str, entries: Sequence[ExperimentEntry], flags: _Flags) -> None:
    """Run experiments; those of ``all`` are put on a page too."""
    recording = _recording(flags)

    from rich.console import Console

    from racecar.maps.whole_files import write_atomically
    from racecar.pipelines.commands.tables import page
    from racecar.pipelines.experiments.html_report import html_report
    from racecar.pipelines.experiments.result import ExperimentResult, ExperimentSettings
    from racecar.pipelines.experiments.result_files import as_rich, save_result
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.parallel_runs import ParallelRuns

    settings = ExperimentSettings(load_config(flags.config).localization, flags.seed, flags.quick, recording)
    parallel = ParallelRuns(flags.scheduler, flags.quiet)
    report = Report(f"racecar experiment {name}")
    report.add(
        "inputs", {"seed": flags.seed, "quick": flags.quick, "settings": settings.localization.model_dump()}
    )
    if recording is not None:
        recording = _tried(recording, entries, settings)
        settings = replace(settings, recording=recording)
        report.add("inputs", {"bag": recording.bag, "map": recording.map, "end_pose": recording.end_pose})
        report.add("inputs", {"initial_pose": recording.initial_pose})
    announce = Console(stderr=True, quiet=flags.quiet, highlight=False)
    tables = page(quiet=flags.quiet)
    done: dict[str, ExperimentResult] = {}
    with output_folder(flags.out) as folder:
        for number, entry in enumerate(entries, start=1):
            announce.print(f"{number}/{len(entries)} {entry.name}", markup=False)
            with report.stage(entry.name):
                result = done[entry.name] = entry.load()(settings, parallel)
                save_result(entry.name, result, folder)
            report.add(entry.name, result.figures)
            for table in result.tables:
                tables.print(as_rich(table))
        shown = f"{done[entries[0].name].pictures[0].name}.png"
        if name == "all":
            shown = "report.html"
            with write_atomically(folder / shown) as partial:
                partial.write_text(html_report(done, settings), encoding="utf-8")
        report.write(folder / "report.json")
    if flags.json is not None:
        report.write(flags.json)
    tables.print(where_to_look(flags.out, shown, flags.json), markup=False, soft_wrap=True)


def _recording(flags: _Flags) -> "BagRecording | None":
    from racecar.maps.errors import UserError
    from racecar.pipelines.experiments.recording import BagRecording

    if flags.bag is None and flags.map is None:
        return None
    if flags.bag is None or flags.map is None:
        raise UserError("--bag and --map go together: the recording, and the map of the place it is from.")
    return BagRecording(
        flags.bag,
        flags.map,
        flags.initial_pose,
        _numbers(flags.end_pose),
        flags.scan_topic,
        flags.odom_topic,
        None if flags.laser_pose is None else parse_laser_pose(flags.laser_pose),
    )


def _tried(
    recording: "BagRecording", entries: Sequence[ExperimentEntry], settings: "ExperimentSettings"
) -> "BagRecording":
    """A recording whose start is known if that matters; it is searched once for all experiments.

    Raises UserError at once, rather than after minutes, for any fault of it.
    """
    recording.load_map()
    next(recording.messages())
    if recording.start() is not None or not any(Uses.KNOWN_START in entry.uses for entry in entries):
        return recording
    from racecar.pipelines.experiments.start_search import found_start

    x, y, yaw = found_start(recording, settings.localization, settings.seed).tolist()
    return replace(recording, initial_pose=(x, y, yaw))


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
