"""Which recording a run's map is of, so that none counts twice."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecar.pipelines.files.report import read_report


class SourceRecording:
    """The part of a bag that a run was made of, as its report's inputs name it."""

    def __init__(self, inputs: Any) -> None:
        """What is no inputs of a run is of no recording that is known."""
        known: Mapping[str, Any] = inputs if isinstance(inputs, dict) else {}
        self._bag = known.get("bag_fingerprint")
        part = known.get("part")
        part = part if isinstance(part, dict) else {}
        duration = part.get("duration")
        self._begin = float(part.get("start") or 0.0)
        self._end = math.inf if duration is None else self._begin + float(duration)
        self.is_all = known.get("continue") is None
        """Whether the map is of nothing else."""

    @classmethod
    def of_run(cls, folder: Path) -> "SourceRecording":
        """That of a run's folder."""
        return cls(read_report(folder).get("inputs"))

    def is_within(self, other: "SourceRecording") -> bool:
        """Whether all of it is known to be in another one, by the content of the bag."""
        is_same_bag = self._bag is not None and self._bag == other._bag
        return is_same_bag and other._begin <= self._begin and self._end <= other._end
