"""Work on a bag in a separate process, which reports to the page through a pipe."""

import signal
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.check import BagCheck
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.calibration_run import check_reader
from racecar.pipelines.runs.mapping_job import MappingJob, carry_out
from racecar.pipelines.runs.other_process import leave_terminal_alone
from racecar.pipelines.runs.progress import Listener
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.run_lock import run_lock
from racecar.pipelines.studio.map_bag.sketcher import Sketcher, finished_sketch
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.config import SensorConfig

_TELL_EVERY = 0.2
"""Seconds between progress reports; nobody reads faster."""


STOPPED = "It was stopped, and no map was written."


@dataclass(frozen=True)
class Progress:
    """How much of the work is done."""

    what: str
    share: float
    """0 to 1."""


News = Progress | OccupancyGrid | Glimpse
"""Messages sent during the work."""


@dataclass(frozen=True)
class WrittenMap:
    """A map was written."""

    folder: Path
    summary: str
    """The verdict."""
    warnings: list[str]


def check_and_tell(bag: Path, sensors: SensorConfig, told: Connection) -> BagCheck:
    """Read and check a bag. Raises UserError."""
    leave_terminal_alone()
    with BagReader(bag, sensors=sensors) as reader:
        return check_reader(reader, RunContext(listen=_telling(told)))


def map_and_tell(job: MappingJob, told: Connection) -> WrittenMap:
    """Map a bag. SIGTERM ends the reading, and the map is built from what was read. Raises UserError."""
    leave_terminal_alone()
    context = RunContext(
        Report("racecar map"),
        listen=_telling(told),
        watch=Sketcher(job.config.mapping, told.send).watch,
        stop_signals=(signal.SIGTERM,),
    )
    try:
        with run_lock(job.out):
            run = carry_out(job, context)
    except KeyboardInterrupt as stop:  # raised by a stop after or before the reading
        raise UserError(STOPPED) from stop
    for news in finished_sketch(run.result):
        told.send(news)
    return WrittenMap(job.out, run.quality.summary, run.warnings)


def _telling(told: Connection) -> Listener:
    """A listener that sends progress to the pipe, at limited rate."""
    last_what, due = "", 0.0

    def tell(what: str, share: float) -> None:
        nonlocal last_what, due
        now = time.monotonic()
        if what != last_what or now >= due:
            last_what, due = what, now + _TELL_EVERY
            told.send(Progress(what, share))

    return tell
