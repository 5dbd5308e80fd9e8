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
"""Called after each scan with the mapper, the scan, and the car's pose (3,) in the map as known then."""


def _nobody_watches(_mapper: "Mapper", _scan: Scan, _map_from_base: Pose) -> None:
    """Of a run that is not looked at."""


@dataclass(frozen=True, eq=False)
class RunContext:
    """Where figures and warnings go, who is told how far it is, who watches, and what ends the reading."""

    report: Report = field(default_factory=lambda: Report("racecar"))
    quiet: bool = True
    """Whether no terminal shows the progress."""
    listen: Listener = nobody_listens
    """Hears of all progress, quiet or not."""
    announce: Callable[[str], None] = lambda sentence: None
    """Takes a sentence about what begins now."""
    watch: Watch = _nobody_watches
    stop_signals: Collection[signal.Signals] = ()
    """The first of them ends the reading of a bag that is mapped, and what was read becomes the map."""

    def progress(
        self, description: str, total: float = 1.0
    ) -> AbstractContextManager[Callable[[float], None]]:
        """Yields a function to call with how much of ``total`` is done so far."""
        return progress_bar(description, total, quiet=self.quiet, listen=self.listen)
