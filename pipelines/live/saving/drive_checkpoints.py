"""Checkpoints of a live drive, from which it goes on when its node was killed."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from pydantic import Field

from racecar.mapping.arrays import Arrays
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.mapper_state import Snapshot
from racecar.maps.errors import UserError
from racecar.maps.settings import Settings
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.parameters import declare_settings
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.runs.checkpoint import Checkpoint

CHECKPOINT_WORK = {"checkpoint": 1}
"""The kind of work for the worker, and how much of it may wait."""

_LEAST_REST = 50.0
"""Times as long as writing takes: a long drive has a large checkpoint, and 2 % of a core are well spent."""


class _Period(Settings):
    """How often."""

    checkpoint_every: float = Field(
        15.0,
        ge=0.1,
        le=86400.0,
        description="seconds between two checkpoints, from which the drive goes on when the node was killed",
    )


@dataclass(frozen=True, eq=False)
class DriveSnapshot:
    """A drive as it was at one moment."""

    arrays: Snapshot
    messages: int
    """How many of them the mapper had taken."""
    besides: Arrays
    """What is kept besides the mapper."""


class DriveCheckpoints:
    """Writes a checkpoint from time to time; where it cannot be written the drive goes on without."""

    def __init__(
        self,
        node: Any,
        checkpoint: Checkpoint,
        worker: Worker,
        faults: Faults,
        inform: Callable[[str], None],
    ) -> None:
        """Raises UserError that names a parameter at fault."""
        self._checkpoint, self._worker = checkpoint, worker
        self._faults, self._inform = faults, inform
        self._period = declare_settings(node, _Period(), read_only=True).checkpoint_every
        self._due = time.monotonic() + self._period

    def save_when_due(self, take_snapshot: Callable[[], DriveSnapshot]) -> None:
        """Let the worker write a snapshot that is taken now, if it is time."""
        if time.monotonic() < self._due:
            return
        self._due = float("inf")
        snapshot = take_snapshot()
        self._worker.inbox.put("checkpoint", partial(self._save, snapshot))

    def keep(self, snapshot: DriveSnapshot) -> None:
        """Write a snapshot now, of a drive that goes on another time, and say so."""
        if self._save(snapshot):
            self._inform(f"The drive is kept in {self._checkpoint.path}; the same command goes on with it.")

    def set_aside(self) -> None:
        """The file that is there is of an earlier drive."""
        self._checkpoint.set_aside()

    def earlier(self, config: MappingConfig) -> list[Mapper]:
        """The mappers of the earlier drives. Raises UserError where a file is damaged."""
        return self._checkpoint.earlier(config)

    def remove(self) -> None:
        """The drive is over."""
        self._checkpoint.remove()

    def _save(self, snapshot: DriveSnapshot) -> bool:
        began, is_written = time.monotonic(), False
        try:
            self._checkpoint.save(snapshot.arrays(), snapshot.messages, snapshot.besides)
            self._faults.end("checkpoint", "Checkpoints are written again.")
            is_written = True
        except (UserError, OSError) as error:
            self._faults.report("checkpoint", f"No checkpoint is written: {error}")
        now = time.monotonic()
        self._due = now + max(self._period, _LEAST_REST * (now - began))
        return is_written
