"""Checkpoints: a live drive whose node was killed goes on from the last one, to the same result."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import count, takewhile
from os.path import realpath
from pathlib import Path
from typing import Any

import numpy as np

from racecar.mapping.arrays import Arrays, named, part_of
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.errors import UserError
from racecar.pipelines.files.session_file import load_arrays, save_arrays


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

    def resume(self, config: MappingConfig) -> MappingStart | None:
        """What to go on from; None when there is nothing.

        Raises UserError when the file that is there is of another run, or cannot be read.
        """
        return _mapper_of(self.path, self._run, config) if self.path.exists() else None

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
