"""The localizer's accuracy: every row of the documentation's tables, measured."""

from functools import partial
from typing import Annotated

import typer

from benchmarks.accuracy.finding import find, finding_cases
from benchmarks.accuracy.tracking import track, tracking_cases
from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import DataOption, recordings_folder
from benchmarks.recordings.recordings import find_recordings, match_recording


def accuracy(
    bench: Bench,
    seeds: Annotated[
        int, typer.Option("--seeds", min=1, metavar="N", help="Drives of each kind on each map.")
    ] = 10,
    minutes: Annotated[
        float,
        typer.Option("--minutes", min=0.1, metavar="MINUTES", help="Length of the drive for false alarms."),
    ] = 60.0,
    data: DataOption = None,
) -> None:
    """Localize simulated drives on the shipped maps: known, fast, with errors in the map, lost, carried away.

    Where there are recordings, these too, compared with an exhaustive match of single scans.

    Example: python -m benchmarks accuracy --seeds 2 --minutes 5
    """
    settings = bench.settings.localization
    tracked = tracking_cases(range(bench.seed, bench.seed + seeds), minutes)
    bench.table(
        "Tracking from a known start: errors of all scans",
        bench.each("tracking", tracked, partial(track, settings=settings)),
    )
    bench.table(
        "Finding a place: within 0.25 m after 3 s of driving",
        bench.each("finding", finding_cases(seeds), partial(find, settings=settings)),
    )
    if recordings := find_recordings(recordings_folder(data)):
        bench.table(
            "Recordings from an unknown start: every 50th scan beside an exhaustive match within 4 m",
            bench.each("recordings", recordings, partial(match_recording, settings=bench.settings)),
        )
