"""``racecar experiment``: a command for each experiment of the catalogue, and one for all of them."""

from collections.abc import Mapping, Sequence
from functools import partial
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
    ReadingFlags,
    ScanTopicOption,
    SchedulerOption,
    SeedOption,
    numbers_in,
)
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.results import where_to_look
from racecar.pipelines.experiments.catalogue import CATALOGUE, ExperimentEntry, Uses

if TYPE_CHECKING:
    from racecar.pipelines.experiments.recording import Recording
    from racecar.pipelines.files.config_file import Config

_ResultFolderOption = Annotated[
    OutputFolderOption,
    WritesFolder(lambda flags: ("report.json", "report.html", *(f"{entry.name}.md" for entry in CATALOGUE))),
]
_QuickOption = Annotated[
    bool,
    typer.Option(
        "--quick", help="Few repetitions: enough to see that everything works, not to draw conclusions."
    ),
]
_RecordingOption = Annotated[
    Path | None, typer.Option("--bag", metavar="BAG", help="Also on this recording.", show_default=False)
]
_RecordingMapOption = Annotated[
    Path | None,
    typer.Option("--map", metavar="MAP", help="The map of the recording's place.", show_default=False),
]
_InitialPoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--initial-pose",
        metavar="X Y YAW",
        help="Where the recording starts, metres and radians of the map; by default, as the map's "
        "trajectory.tum says if the recording made the map, else it is searched for.",
        show_default=False,
    ),
]
_EndPoseOption = Annotated[
    str | None,
    typer.Option(
        "--end-pose",
        metavar="'X Y [YAW]'",
        help="Where the recording ends by tape measure, metres and radians of the map.",
        show_default=False,
    ),
]
_ANY_RECORDING = Uses.RECORDING | Uses.EXTRA_RECORDING
_REQUIRED = Parameter.empty
_FLAGS: tuple[tuple[str, Any, Any, Uses | None], ...] = (
    ("bag", BagArgument, _REQUIRED, Uses.RECORDING),
    ("map", MapOption, _REQUIRED, Uses.RECORDING),
    ("out", _ResultFolderOption, _REQUIRED, None),
    ("bag", _RecordingOption, None, Uses.EXTRA_RECORDING),
    ("map", _RecordingMapOption, None, Uses.EXTRA_RECORDING),
    ("initial_pose", _InitialPoseOption, None, _ANY_RECORDING),
    ("end_pose", _EndPoseOption, None, Uses.END_POSE),
    ("scan_topic", ScanTopicOption, None, _ANY_RECORDING),
    ("odom_topic", OdomTopicOption, None, _ANY_RECORDING),
    ("laser_pose", LaserPoseOption, None, _ANY_RECORDING),
    ("quick", _QuickOption, False, Uses.REPETITIONS),
    ("scheduler", SchedulerOption, None, Uses.REPETITIONS),
    ("config", ConfigOption, None, Uses.SETTINGS),
    ("seed", SeedOption, 0, Uses.SETTINGS),
    ("json", JsonOption, None, None),
    ("quiet", QuietOption, False, None),
)
"""Name, parser with help, default, and the uses of an experiment that require the flag (None: always there),
in the order of the help."""

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
    """Add a command that runs some experiments to an app, with the flags that they use."""
    given = {flag: default for flag, _, default, _ in _FLAGS if default is not _REQUIRED}

    def command(**flags: Any) -> None:
        _run(name, entries, {**given, **flags})

    parameters = [
        Parameter(flag, Parameter.KEYWORD_ONLY, annotation=kind, default=default)
        for flag, kind, default, brought_by in _FLAGS
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


def _run(name: str, entries: Sequence[ExperimentEntry], flags: Mapping[str, Any]) -> None:
    """Run experiments; those of ``all`` are also shown on a page."""
    from rich.box import MARKDOWN
    from rich.console import Console

    from racecar.maps.whole_files import write_atomically
    from racecar.pipelines.commands.tables import figure_table, page
    from racecar.pipelines.experiments.experiment import ExperimentSettings
    from racecar.pipelines.experiments.html_report import html_report
    from racecar.pipelines.experiments.page import Page
    from racecar.pipelines.experiments.recording import with_known_start
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.parallel_runs import ParallelRuns

    config, seed, quiet = load_config(flags["config"]), flags["seed"], flags["quiet"]
    localization, recording = config.localization, _recording(flags, config)
    report = Report(f"racecar experiment {name}")
    report.add("inputs", {"seed": seed, "quick": flags["quick"], "settings": localization.model_dump()})
    if recording is not None:
        if any(Uses.EXTRA_RECORDING in entry.uses for entry in entries):  # once for all experiments
            recording = with_known_start(recording, localization, seed)
        report.add("inputs", {"bag": flags["bag"], "map": flags["map"], "end_pose": recording.end})
        report.add("inputs", {"initial_pose": recording.start})
    settings = ExperimentSettings(localization, seed, flags["quick"], recording)
    parallel = ParallelRuns(flags["scheduler"], quiet)
    announce, tables = Console(stderr=True, quiet=quiet, highlight=False), page(quiet=quiet)
    done: dict[str, Page] = {}
    with output_folder(flags["out"]) as folder:
        for number, entry in enumerate(entries, start=1):
            announce.print(f"{number}/{len(entries)} {entry.name}", markup=False)
            with report.stage(entry.name):
                result = done[entry.name] = entry.load()(settings, parallel)
                result.save(entry.name, folder)
            report.add(entry.name, result.figures)
            for table in result.tables:
                tables.print(figure_table(table.columns, table.rows, title=table.title, box=MARKDOWN))
        shown = f"{done[entries[0].name].pictures[0].name}.png"
        if name == "all":
            shown = "report.html"
            with write_atomically(folder / shown) as partial:
                partial.write_text(html_report(done, settings), encoding="utf-8")
        report.write(folder / "report.json")
    if flags["json"] is not None:
        report.write(flags["json"])
    tables.print(where_to_look(flags["out"], shown, flags["json"]), markup=False, soft_wrap=True)


def _recording(flags: Mapping[str, Any], config: "Config") -> "Recording | None":
    """The given recording. Raises UserError for its faults at once, rather than after minutes."""
    from racecar.maps.errors import UserError
    from racecar.pipelines.experiments.recording import bag_recording

    if flags.get("bag") is None and flags.get("map") is None:
        return None
    if flags["bag"] is None or flags["map"] is None:
        raise UserError("--bag and --map go together: the recording, and the map of the place it is from.")
    topics = {name: flags[name] for name in ("scan_topic", "odom_topic", "laser_pose")}
    return bag_recording(
        flags["bag"],
        flags["map"],
        partial(ReadingFlags(**topics).parsed().open, flags["bag"], config.sensors),
        flags["initial_pose"],
        _numbers(flags["end_pose"]),
    )


def _numbers(text: str | None) -> tuple[float, ...] | None:
    """Two or three numbers."""
    from math import isfinite

    from racecar.maps.errors import UserError

    if text is None:
        return None
    numbers = numbers_in(text) or []
    if len(numbers) not in (2, 3) or not all(isfinite(number) for number in numbers):
        raise UserError(f"--end-pose is '{text}'; give x and y in metres and, if measured, yaw in radians.")
    return tuple(numbers)
