"""Checkpoints: a mapping run that was killed goes on from the last one, to the same result."""

import json
import logging
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import count, takewhile
from os.path import realpath
from pathlib import Path
from typing import Any

import numpy as np

from racecar.mapping.arrays import Arrays, named, part_of
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.errors import UserError
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.session_file import load_arrays, save_arrays

EVERY_SECONDS = 60.0
"""How much work is lost when a run is killed."""
_LEAST_WORK = 50.0
"""How many times as long as writing a checkpoint the work between two of them takes, so that writing costs at
most 2 % of a long run, whose checkpoints are large."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class MappingStart:
    """What a run begins with, or goes on from."""

    mapper: Mapper
    messages: int = 0
    """How many of them the mapper has taken."""
    besides: Arrays = field(default_factory=dict)
    """What was kept besides the mapper."""
    seconds_ago: float = 0.0
    """When the run was broken off."""


def checkpoint_file(out: Path) -> Path:
    """Where the checkpoints of a run with this output folder lie."""
    folder = Path(realpath(out))
    return folder.parent / f"{folder.name}.checkpoint.npz"


class Checkpoint:
    """The file beside a run's output folder that holds its mapper from time to time."""

    def __init__(self, out: Path, run: Mapping[str, Any]) -> None:
        """``run`` is what must be the same for a run to go on from a checkpoint, in types that JSON knows."""
        self.path = checkpoint_file(out)
        self._run = json.dumps(run, sort_keys=True)
        self._due = time.monotonic() + EVERY_SECONDS

    def resume(self, config: MappingConfig) -> MappingStart | None:
        """What to go on from; None when there is nothing.

        Raises UserError when the file that is there is of another run, or cannot be read.
        """
        return _mapper_of(self.path, self._run, config) if self.path.exists() else None

    def save_when_due(self, mapper: Mapper, messages: int) -> None:
        """Write the mapper, which has taken ``messages``, if it is time and the mapper can be saved.

        Where it cannot be written, the run goes on without one.
        """
        start = time.monotonic()
        if start < self._due or not mapper.can_be_saved:
            return
        try:
            self.save(mapper.to_arrays(), messages)
        except (UserError, OSError) as error:
            _log.warning("No checkpoint was written: %s", error)
        now = time.monotonic()
        self._due = now + max(EVERY_SECONDS, _LEAST_WORK * (now - start))

    def save(self, arrays: Arrays, messages: int, besides: Arrays | None = None) -> None:
        """Write the arrays of a mapper that has taken ``messages``, and what else is to be kept. Raises
        UserError or OSError where that cannot be."""
        marks = {"run": np.array(self._run), "messages": np.array(messages)}
        save_arrays({**marks, **named("besides", besides or {}), **arrays}, self.path, "racecar checkpoint")

    def set_aside(self) -> None:
        """Keep the file that is there as one of an earlier drive: the run begins another one."""
        taken = len(self._earlier_files())
        self.path.rename(self.path.with_name(f"{self.path.stem}.{taken + 1}.npz"))

    def earlier(self, config: MappingConfig) -> list[Mapper]:
        """The mappers of the drives that were set aside, in their order. Raises UserError as `resume`
        does."""
        return [_mapper_of(path, self._run, config).mapper for path in self._earlier_files()]

    def forget_earlier(self) -> None:
        """Nothing goes on from the drives that were set aside."""
        for path in self._earlier_files():
            path.unlink()

    def remove(self) -> None:
        """The run is over."""
        self.forget_earlier()
        self.path.unlink(missing_ok=True)

    def _earlier_files(self) -> list[Path]:
        """Numbered in their order."""
        numbered = (self.path.with_name(f"{self.path.stem}.{number}.npz") for number in count(1))
        return list(takewhile(Path.is_file, numbered))


def _mapper_of(path: Path, run: str, config: MappingConfig) -> MappingStart:
    arrays = load_arrays(path, "racecar checkpoint")
    if str(arrays.get("run")) != run:
        raise UserError(f"{path} is of another bag or of other settings.")
    try:
        mapper = Mapper.from_arrays(config, arrays)
        return MappingStart(mapper, int(arrays["messages"]), part_of("besides", arrays))
    except MemoryError:
        raise
    except Exception as error:  # of what is damaged, the parts of a mapper raise whatever they trip over
        raise UserError(f"{path} is damaged.") from error


def describe_run(reader: BagReader, config: MappingConfig) -> dict[str, Any]:
    """What makes a run the same run: the bag's files, how they are read, and the settings."""
    bag = reader.path
    files = sorted(path for path in bag.rglob("*") if path.is_file()) if bag.is_dir() else [bag]
    return {
        "files": [[path.name, path.stat().st_size, path.stat().st_mtime_ns] for path in files],
        "part": asdict(reader.part),
        "scan_topics": reader.scan_topics,
        "odometry": reader.odometry_source,
        "base_from_laser": reader.base_from_laser.tolist(),
        "settings": config.model_dump(),
    }
