"""Which recording a run's map is of, so that none counts twice."""

import math
from collections.abc import Mapping
from os.path import realpath
from pathlib import Path
from typing import Any

from racecar.pipelines.files.report import read_inputs


class SourceRecording:
    """The part of a bag that a run was made of, as its report's inputs name it."""

    def __init__(self, inputs: Mapping[str, Any]) -> None:
        """Without any inputs it is of no recording that is known."""
        self._named = inputs.get("bag")
        self.fingerprint = inputs.get("bag_fingerprint")
        """Of the bag's content; None where the report does not hold it."""
        part = inputs.get("part")
        part = part if isinstance(part, dict) else {}
        self._begin = _seconds(part.get("start"), 0.0)
        self._end = self._begin + _seconds(part.get("duration"), math.inf)
        self.is_all = inputs.get("continue") is None
        """Whether the map is of nothing else."""

    @classmethod
    def of_run(cls, folder: Path) -> "SourceRecording":
        """That of a run's folder."""
        return cls(read_inputs(folder))

    def is_at_path_of(self, bag: Path) -> bool:
        """Whether it was read from there, whatever became of the file."""
        named = self._named
        return isinstance(named, str) and "\0" not in named and realpath(named) == realpath(bag)

    def is_within(self, other: "SourceRecording") -> bool:
        """Whether all of it is known to be in another one, by the content of the bag."""
        is_same_bag = self.fingerprint is not None and self.fingerprint == other.fingerprint
        return is_same_bag and other._begin <= self._begin and self._end <= other._end


def _seconds(value: object, otherwise: float) -> float:
    """What a report that may be damaged says."""
    return float(value) if isinstance(value, int | float) else otherwise
