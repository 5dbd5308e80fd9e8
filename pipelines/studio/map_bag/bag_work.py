"""What is done with a bag in a process of its own, and told to the page by a pipe."""

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
from racecar.pipelines.runs.progress import progress_heard_by
from racecar.pipelines.runs.run_lock import run_lock
from racecar.pipelines.studio.map_bag.sketcher import Sketcher, finished_sketch
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.config import SensorConfig

_TELL_EVERY = 0.2
"""Seconds between two words about progress, which nobody reads faster."""


STOPPED = "It was stopped, and no map was written."


@dataclass(frozen=True)
class Progress:
    """How far it is."""

    what: str
    share: float
    """0 to 1."""


News = Progress | OccupancyGrid | Glimpse
"""What is told meanwhile."""


@dataclass(frozen=True)
class Mapped:
    """A map was written."""

    folder: Path
    summary: str
    """The verdict."""
    warnings: list[str]


def check_and_tell(bag: Path, sensors: SensorConfig, told: Connection) -> BagCheck:
    """Read a bag for what it holds. Raises UserError."""
    with _progress_told(told), BagReader(bag, sensors=sensors) as reader:
        return check_reader(reader, quiet=True)


def map_and_tell(job: MappingJob, told: Connection) -> Mapped:
    """Map a bag; SIGTERM ends the reading, and what was read becomes the map. Raises UserError."""
    report = Report("racecar map")
    sketcher = Sketcher(job.config.mapping, told.send)
    try:
        with _progress_told(told), run_lock(job.out):
            mapped = carry_out(
                job,
                report,
                quiet=True,
                watch=sketcher.watch,
                stop_signals=(signal.SIGTERM,),
            )
    except KeyboardInterrupt as stop:  # as it is called when the reading is over, or has not begun
        raise UserError(STOPPED) from stop
    for news in finished_sketch(mapped.result):
        told.send(news)
    return Mapped(job.out, mapped.quality.summary, report.warnings)


@contextmanager
def _progress_told(told: Connection) -> Iterator[None]:
    """Meanwhile progress goes into the pipe, and nothing to the terminal of whoever serves the page."""
    leave_terminal_alone()
    last_what, due = "", 0.0

    def tell(what: str, share: float) -> None:
        nonlocal last_what, due
        now = time.monotonic()
        if what != last_what or now >= due:
            last_what, due = what, now + _TELL_EVERY
            told.send(Progress(what, share))

    with progress_heard_by(tell):
        yield
