"""Saving the map of a drive: at its end, or in between from a snapshot while it goes on."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from racecar.mapping.arrays import Arrays
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.errors import UserError
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.checkpoint import Checkpoint, MappingStart
from racecar.pipelines.runs.mapping_run import finish_and_save
from racecar.pipelines.runs.other_process import in_fresh_process
from racecar.pipelines.runs.place_finding import found_on

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

    def save(self, drives: Sequence[Mapper]) -> list[str]:
        """Finish the map of some drives and write all files of it; the mappers are at their ends.

        Each drive carries on the map of those before where it is recognized there; of any other the map goes
        into a folder of its own, which the sentences returned name. Raises UserError when there is nothing to
        save or the folder cannot be written to.
        """
        earlier, unrecognized = None, []
        for mapper in drives:
            try:
                session = finish_and_save(mapper, self._report(), self.folder, earlier).session
                earlier = found_on(session, Config(mapping=self.config))
            except NotRecognizedError as error:
                beside = (self.folder.with_name(f"{self.folder.name}-{number}") for number in count(2))
                own = next(folder for folder in beside if not folder.exists())
                finish_and_save(mapper, self._report(), own)
                unrecognized.append(f"{error}; its map is in {own}, in a frame of its own.")
        return unrecognized

    def _report(self) -> Report:
        report = Report("racecar live map")
        report.add("inputs", dict(self.run))
        return report

    def save_snapshot(self, arrays: Arrays, messages: int, besides: Arrays) -> None:
        """The same from the arrays of a mapper that drives on; the work is done in a process of its own,
        which leaves the cores to the drive.

        Raises UserError as `save` does.
        """
        self.checkpoint().save(arrays, messages, besides)
        in_fresh_process(partial(_save_checkpoint, self), threads=1, is_urgent=False)


def resume(output: MapOutput, *, anew: bool, announce: Callable[[str], None]) -> MappingStart:
    """What to begin with: the mapper of a drive whose node was killed not long ago, which is announced, or a
    new one."""
    checkpoint = output.checkpoint()
    resumed = None if anew else _resumed(output, checkpoint, announce)
    if resumed is None:
        checkpoint.forget_earlier()
        return MappingStart(Mapper(output.config))
    announce(f"The node was killed: the drive goes on from {checkpoint.path}.")
    return resumed


def _resumed(
    output: MapOutput, checkpoint: Checkpoint, announce: Callable[[str], None]
) -> MappingStart | None:
    if not checkpoint.path.is_file():
        return None
    seconds = time.time() - checkpoint.path.stat().st_mtime
    if seconds > _RESUMED_WITHIN:
        announce(f"{checkpoint.path} is of an earlier drive and is not used.")
        return None
    try:
        resumed = checkpoint.resume(output.config)
    except UserError as error:
        announce(f"The checkpoint is not used and the drive begins from scratch: {error}")
        return None
    return None if resumed is None else replace(resumed, seconds_ago=seconds)


def _save_checkpoint(output: MapOutput) -> None:
    resumed = output.checkpoint().resume(output.config)
    if resumed is None:
        raise UserError(f"There is no {output.checkpoint().path} any more, so no map was saved.")
    output.save([*output.checkpoint().earlier(output.config), resumed.mapper])
