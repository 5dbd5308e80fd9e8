"""Saving the map of a drive: at its end, or in between from a snapshot while it goes on."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from racecar.mapping.arrays import Arrays
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.errors import UserError
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.checkpoint import Checkpoint, MappingStart
from racecar.pipelines.runs.mapping_run import finish_and_save
from racecar.pipelines.runs.other_process import in_fresh_process

_RESUMED_WITHIN = 3600.0
"""Seconds after which a checkpoint is no longer of the drive that goes on now."""


@dataclass(frozen=True)
class MapOutput:
    """Where the map of a live drive goes, and what identifies the drive."""

    folder: Path
    config: MappingConfig
    run: Mapping[str, Any]

    def checkpoint(self) -> Checkpoint:
        """The file from which the drive is carried on when its node was killed."""
        return Checkpoint(self.folder, self.run)

    def save(self, mapper: Mapper) -> None:
        """Finish the map and write all files of it; the mapper is at its end.

        Raises UserError when there is nothing to save or the folder cannot be written to.
        """
        report = Report("racecar live map")
        report.add("inputs", dict(self.run))
        finish_and_save(mapper, report, self.folder)

    def save_snapshot(self, arrays: Arrays, messages: int, besides: Arrays) -> None:
        """The same from the arrays of a mapper that drives on; the work is done in a process of its own.

        Raises UserError as `save` does.
        """
        self.checkpoint().save(arrays, messages, besides)
        in_fresh_process(partial(_save_checkpoint, self))


def resume(output: MapOutput, *, anew: bool, announce: Callable[[str], None]) -> MappingStart:
    """What to begin with: the mapper of a drive whose node was killed not long ago, which is announced, or a
    new one."""
    checkpoint = output.checkpoint()
    if anew or not checkpoint.path.is_file():
        return MappingStart(Mapper(output.config))
    if time.time() - checkpoint.path.stat().st_mtime > _RESUMED_WITHIN:
        announce(f"{checkpoint.path} is of an earlier drive and is not used.")
        return MappingStart(Mapper(output.config))
    try:
        resumed = checkpoint.resume(output.config)
    except UserError as error:
        announce(f"The checkpoint is not used and the drive begins from scratch: {error}")
        resumed = None
    if resumed is None:
        return MappingStart(Mapper(output.config))
    announce(f"The node was killed: the drive goes on from {checkpoint.path}.")
    return resumed


def _save_checkpoint(output: MapOutput) -> None:
    resumed = output.checkpoint().resume(output.config)
    if resumed is None:
        raise UserError(f"There is no {output.checkpoint().path} any more, so no map was saved.")
    output.save(resumed.mapper)
