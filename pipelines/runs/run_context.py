"""What accompanies a run, from the command to the innermost loop."""

import signal
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.progress import Listener, nobody_listens, progress_bar
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.mapping.mapper import Mapper

Watch: TypeAlias = "Callable[[Mapper, Scan, Pose], None]"
"""Called after each scan with the mapper, the scan, and the car's current pose (3,) in the map."""


def _nobody_watches(_mapper: "Mapper", _scan: Scan, _map_from_base: Pose) -> None:
    """Watcher of a run that nobody watches."""


@dataclass(frozen=True, eq=False)
class RunContext:
    """The report for figures and warnings, the listeners for progress, the watcher, and the stop signals."""

    report: Report = field(default_factory=lambda: Report("racecar"))
    quiet: bool = True
    """Whether the terminal shows no progress."""
    listen: Listener = nobody_listens
    """Receives all progress, quiet or not."""
    announce: Callable[[str], None] = lambda sentence: None
    """Receives a sentence about the next step."""
    watch: Watch = _nobody_watches
    stop_signals: Collection[signal.Signals] = ()
    """The first of these signals ends the reading of a bag; the map is made of what was read by then."""

    def progress(
        self, description: str, total: float = 1.0
    ) -> AbstractContextManager[Callable[[float], None]]:
        """Yields a function to call with how much of ``total`` is done so far."""
        return progress_bar(description, total, quiet=self.quiet, listen=self.listen)
