"""``python -m benchmarks``: a command for each benchmark."""

import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines import cli
from racecar.pipelines.commands.options import (
    PAGE_WIDTH,
    ConfigOption,
    JsonOption,
    QuietOption,
    SeedOption,
)

if TYPE_CHECKING:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.files.report import Report

TITLE = "python -m benchmarks"
app = typer.Typer(pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]})


@app.callback()
def _describe() -> None:
    """Measure what the documentation states: accuracy, time and memory."""


@dataclass(frozen=True)
class _Output:
    """Where a benchmark's figures go."""

    announce: Callable[[str], None]
    """Says what is being done, on stderr."""
    show: Callable[..., None]
    """Prints tables."""
    report: "Report"


@contextmanager
def _output(name: str, inputs: Mapping[str, Any], json: Path | None, quiet: bool) -> Iterator[_Output]:
    """Yield where figures go; when all are there, the report is written to ``json``, if one is named."""
    from rich.console import Console

    from racecar.pipelines.commands.written_files import where_figures_are
    from racecar.pipelines.files.report import Report

    announce = Console(stderr=True, quiet=quiet, highlight=False).print
    page = Console(quiet=quiet, highlight=False, width=None if sys.stdout.isatty() else PAGE_WIDTH)
    report = Report(f"{TITLE} {name}")
    report.add("inputs", inputs)
    yield _Output(announce, page.print, report)
    if json is not None:
        report.write(json)
        page.print(where_figures_are(json), markup=False, soft_wrap=True)


@app.command()
def slam(
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DIR",
            help="Folder of the logs, or one that has them in slam_benchmark: each a bag with a .relations "
            "file of the same name. Default: $RACECAR_DATA, else ../shared/data beside the project.",
            show_default=False,
        ),
    ] = None,
    logs: Annotated[
        list[str] | None,
        typer.Option("--logs", metavar="NAME", help="Only this log; may be repeated.", show_default=False),
    ] = None,
    ablation: Annotated[bool, typer.Option("--ablation", help="Also map with one part left out.")] = False,
    false_loops: Annotated[
        bool, typer.Option("--false-loops", help="Also put as many wrong loops as true ones into the graphs.")
    ] = False,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Map the logs of the SLAM benchmark, each in a fresh process, and compare with the published figures.

    Example: python -m benchmarks slam --json slam.json
    """
    from benchmarks.recordings_folder import recordings_folder
    from benchmarks.slam.logs import find_logs
    from racecar.pipelines.files.config_file import load_config

    settings = load_config(config).mapping
    folder = recordings_folder() if data is None else data
    chosen = find_logs(folder, logs or ())

    from benchmarks.slam.ablation import ablate
    from benchmarks.slam.log_benchmark import measure_all
    from benchmarks.slam.published import PUBLISHED
    from benchmarks.slam.tables import (
        ablation_table,
        accuracy_table,
        false_loops_table,
        stages_table,
    )
    from racecar.pipelines.commands.printed_warnings import print_warnings
    from racecar.pipelines.runs.other_process import in_fresh_process
    from racecar.pipelines.warm_up import warm_up

    inputs = {"data": folder, "config": config, "seed": seed, "settings": settings.model_dump()}
    with _output("slam", inputs, json, quiet) as output:
        announce, report = output.announce, output.report
        announce("Compiling the kernels")
        in_fresh_process(warm_up)
        runs = measure_all(
            chosen, settings, false_loops_seed=seed if false_loops else None, announce=announce, quiet=quiet
        )
        report.add("logs", {log: run.as_dict() for log, run in runs.items()})
        report.add("published", {log: asdict(PUBLISHED[log]) for log in runs if log in PUBLISHED})
        output.show(accuracy_table(runs), stages_table(runs))
        if false_loops:
            bent = {log: run.false_loops for log, run in runs.items() if run.false_loops is not None}
            report.add("false_loops", {log: figures.as_dict() for log, figures in bent.items()})
            output.show(false_loops_table(bent))
        if ablation:
            variants = ablate(chosen, settings, runs, announce=announce, quiet=quiet)
            accuracies = {
                name: {log: run.accuracy for log, run in changed.items()}
                for name, changed in variants.items()
            }
            report.add("ablation", accuracies)
            output.show(ablation_table(variants))
        if not quiet:
            print_warnings(
                f"{log}: {sentence}" for log, run in runs.items() for sentence in run.report["warnings"]
            )


@app.command()
def growth(
    minutes: Annotated[
        float, typer.Option("--minutes", min=0.1, metavar="MINUTES", help="Length of the simulated drive.")
    ] = 120.0,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Map a long simulated drive through the building and report whether a scan costs more towards its end.

    Example: python -m benchmarks growth --minutes 20
    """
    from racecar.pipelines.files.config_file import load_config

    settings = load_config(config).mapping

    from benchmarks.slam.growth import measure_growth
    from benchmarks.slam.tables import growth_table
    from racecar.pipelines.runs.other_process import in_fresh_process
    from racecar.pipelines.warm_up import warm_up

    inputs = {"minutes": minutes, "config": config, "seed": seed, "settings": settings.model_dump()}
    with _output("growth", inputs, json, quiet) as output:
        output.announce("Compiling the kernels")
        in_fresh_process(warm_up)
        output.announce(f"Driving for {minutes:g} simulated minutes")
        figures = measure_growth(minutes, settings, seed, quiet=quiet)
        output.report.add("growth", {**asdict(figures), "ratio": figures.ratio})
        output.show(growth_table(figures))


@app.command()
def worlds(
    names: Annotated[
        list[str] | None,
        typer.Option("--world", metavar="NAME", help="Only this one; may be repeated.", show_default=False),
    ] = None,
    seeds: Annotated[int, typer.Option("--seeds", min=1, metavar="N", help="Drives through each world.")] = 5,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Map simulated drives, each with a fault that recordings have, and compare with the truth.

    Example: python -m benchmarks worlds --seeds 2 --world slope --world 'one per 2 s'
    """
    from benchmarks.worlds.worlds import choose_worlds
    from racecar.pipelines.files.config_file import load_config

    settings = load_config(config).mapping
    chosen = choose_worlds(names or ())

    from benchmarks.worlds.tables import one_line, worlds_table
    from benchmarks.worlds.world_benchmark import measure_world
    from racecar.pipelines.commands.printed_warnings import print_warnings

    inputs = {"config": config, "seed": seed, "seeds": seeds, "settings": settings.model_dump()}
    with _output("worlds", inputs, json, quiet) as output:
        figures = {}
        for name, world in chosen.items():
            figures[name] = measure_world(world, range(seed, seed + seeds), settings, quiet=True)
            for drive in figures[name]:
                output.announce(one_line(name, drive))
        output.report.add(
            "worlds", {name: [drive.as_dict() for drive in drives] for name, drives in figures.items()}
        )
        output.show(worlds_table(figures))
        if not quiet:
            print_warnings(
                f"{name}, seed {drive.seed}: {sentence}"
                for name, drives in figures.items()
                for drive in drives
                for sentence in drive.warnings
            )


@app.command()
def quality(
    drives: Annotated[
        int, typer.Option("--drives", min=0, metavar="N", help="Drives through each of five floor plans.")
    ] = 4,
    faults: Annotated[
        int,
        typer.Option(
            "--faults", min=0, max=40, metavar="N", help="Further maps of each drive, each with one fault."
        ),
    ] = 4,
    bags: Annotated[
        Path | None,
        typer.Option(
            "--bags",
            metavar="DIR",
            help="Also map the recordings below this folder that have their true poses, reference.tum, "
            "beside them.",
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Make maps of known error, many of them wrong, and count how often the verdict on them is right.

    Example: python -m benchmarks quality --drives 1 --json quality.json
    """
    from benchmarks.quality.known_drives import recorded_drives, simulated_drives
    from racecar.maps.errors import UserError
    from racecar.pipelines.files.config_file import load_config

    settings = load_config(config).mapping

    from itertools import chain

    from benchmarks.quality.quality_benchmark import JudgedMap, judged_maps
    from benchmarks.quality.tables import figures_table, one_line, verdicts_table
    from benchmarks.quality.verdict_figures import kind_of, verdict_figures

    inputs = {"drives": drives, "faults": faults, "bags": bags, "config": config, "seed": seed}
    with _output("quality", {**inputs, "settings": settings.model_dump()}, json, quiet) as output:
        recorded = iter(()) if bags is None else recorded_drives(bags)
        maps: list[JudgedMap] = []
        for drive in chain(simulated_drives(drives, seed), recorded):
            for judged in judged_maps(drive, faults, settings):
                output.announce(one_line(judged))
                maps.append(judged)
        if not maps:
            raise UserError("There is nothing to judge: ask for --drives, or name recordings with --bags.")
        figures = verdict_figures(maps, settings.quality)
        output.report.add("figures", figures.as_dict())
        for judged in maps:
            known = {**judged.as_dict(), "is": kind_of(judged, settings.quality)}
            output.report.add("maps", {f"{judged.drive}, {judged.spoiling}": known})
        output.show(verdicts_table(figures), figures_table(figures))


@app.command()
def localizer(
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Time the localizer with 4000 particles and 100 beams, beside plain memory loads and a plain filter.

    On the shipped building and, where there are recordings, the basement's map.
    Example: python -m benchmarks localizer --json localizer.json
    """
    from benchmarks.localizer.localizer_benchmark import (
        FULL,
        benchmark_maps,
        measure_localizer,
    )
    from benchmarks.localizer.tables import CHECKS, checks_table, times_table

    with _output("localizer", {"seed": seed, "workload": asdict(FULL)}, json, quiet) as output:
        maps = {}
        for name, grid in benchmark_maps().items():
            output.announce(f"Measuring on {name}")
            maps[name] = measure_localizer(grid, FULL, seed)
        output.report.add("maps", {name: asdict(figures) for name, figures in maps.items()})
        for check in CHECKS:
            output.report.add("checks", {check.name: check.as_dict(maps)})
        output.show(checks_table(maps), times_table(maps))


@app.command()
def accuracy(
    seeds: Annotated[
        int, typer.Option("--seeds", min=1, metavar="N", help="Drives of each kind on each map.")
    ] = 10,
    minutes: Annotated[
        float,
        typer.Option("--minutes", min=0.1, metavar="MINUTES", help="Length of the drive for false alarms."),
    ] = 60.0,
    ablation: Annotated[
        bool,
        typer.Option(
            "--ablation",
            help="Instead localize with each mechanism of the localizer off, and each group of them.",
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="Of the ablation, only this mechanism, group or kind of drive; may be repeated. A long "
            "run can be made in parts this way. docs/measured/localizer.md explains the names.",
            show_default=False,
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds",
            min=2.0,
            metavar="SECONDS",
            help="Of the ablation: length of its simulated drives (default: 30), and of the part of a "
            "recording that is used (default: all).",
            show_default=False,
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DIR",
            help="Folder of the recordings. Default: $RACECAR_DATA, else ../shared/data beside the project.",
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Localize simulated drives on the shipped maps: known, fast, with errors in the map, lost, carried away.

    Where there are recordings, these too, compared with an exhaustive match of single scans.

    Example: python -m benchmarks accuracy --seeds 2 --minutes 5

    Example: python -m benchmarks accuracy --ablation --only 'changed map, track' --json changed.json
    """
    from benchmarks.recordings_folder import recordings_folder
    from racecar.maps.errors import UserError
    from racecar.pipelines.files.config_file import load_config

    if only and not ablation:
        raise UserError("--only names a part of the ablation; ask for that with --ablation.")
    settings = load_config(config)
    folder = recordings_folder() if data is None else data
    inputs = {"seeds": seeds, "data": folder, "config": config, "settings": settings.model_dump()}
    if ablation:
        inputs |= {"only": only, "seconds": seconds}
        with _output("accuracy --ablation", inputs, json, quiet) as output:
            _ablate(output, folder, settings, seeds, seconds, only or ())
        return

    from benchmarks.accuracy.accuracy_benchmark import AccuracyBenchmark, measure_accuracy
    from benchmarks.accuracy.tables import finding_table, tracking_table
    from benchmarks.recordings.recordings_benchmark import measure_recordings
    from benchmarks.recordings.tables import recordings_table

    with _output("accuracy", {**inputs, "minutes": minutes}, json, quiet) as output:
        benchmark = AccuracyBenchmark(settings.localization, seeds, output.announce)
        tracking, finding = measure_accuracy(benchmark, minutes)
        output.report.add("tracking", {name: asdict(figures) for name, figures in tracking.items()})
        output.report.add("finding", {name: asdict(figures) for name, figures in finding.items()})
        output.show(tracking_table(tracking), finding_table(finding))
        if recordings := measure_recordings(folder, settings, output.announce):
            output.report.add("recordings", {name: asdict(figures) for name, figures in recordings.items()})
            output.show(recordings_table(recordings))


def _ablate(
    output: _Output,
    folder: Path,
    settings: "Config",
    seeds: int,
    seconds: float | None,
    only: Collection[str],
) -> None:
    """Measure and show each kind of drive, and then all of them."""
    from benchmarks.ablation.ablation_benchmark import measure_kind
    from benchmarks.ablation.mechanisms import variants
    from benchmarks.ablation.recorded_drives import recorded_drives
    from benchmarks.ablation.selection import selected
    from benchmarks.ablation.simulated_drives import DRIVE_SECONDS, simulated_drives
    from benchmarks.ablation.tables import effects_table, kind_table

    drives = {**simulated_drives(seconds or DRIVE_SECONDS), **recorded_drives(folder, settings, seconds)}
    chosen_drives, chosen_variants = selected(drives, variants(), only)
    kinds = {}
    for kind, drive_of in chosen_drives.items():
        output.announce(f"{kind}:")
        kinds[kind] = measure_kind(drive_of, chosen_variants, settings.localization, seeds, output.announce)
        output.report.add("ablation", {kind: kinds[kind].as_dict()})
        output.show(kind_table(kind, kinds[kind]))
    output.show(effects_table(kinds))


@app.command()
def live(
    seconds: Annotated[
        float, typer.Option("--seconds", min=5.0, metavar="SECONDS", help="Length of the simulated drive.")
    ] = 60.0,
    speed: Annotated[
        float,
        typer.Option("--speed", min=0.1, max=20.0, metavar="FACTOR", help="Playback speed; 1 is real time."),
    ] = 1.0,
    recorded: Annotated[
        bool,
        typer.Option("--recorded/--no-recorded", help="Also play session_A, where there are recordings."),
    ] = True,
    localizer: Annotated[
        bool, typer.Option("--localizer/--no-localizer", help="Measure the localizer's node.")
    ] = True,
    mapper: Annotated[bool, typer.Option("--mapper/--no-mapper", help="Measure the mapper's node.")] = True,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Play drives to the ROS 2 nodes, and compare latency, CPU, memory and accuracy with offline runs.

    Example: python -m benchmarks live --seconds 60
    """
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()
    settings = load_config(config)

    from benchmarks.live.node_benchmark import measure_drives
    from benchmarks.live.tables import live_table
    from benchmarks.recordings_folder import recordings_folder

    inputs = {"seconds": seconds, "speed": speed, "seed": seed, "settings": settings.model_dump()}
    with _output("live", inputs, json, quiet) as output:
        figures = measure_drives(
            seconds,
            recordings_folder() if recorded else None,
            settings,
            seed=seed,
            speed=speed,
            nodes=[name for name, wanted in (("localizer", localizer), ("mapper", mapper)) if wanted],
            announce=output.announce,
        )
        output.report.add("live", {f"{each.node} {each.drive}": each.as_dict() for each in figures})
        output.show(live_table(figures, speed))


cli.complete(app, TITLE)


def run(arguments: list[str]) -> int:
    """Run one and return its exit code; errors become one sentence on stderr."""
    return cli.run(arguments, app, TITLE)
