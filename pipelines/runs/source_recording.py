"""Which recording a run's map is of, so that none counts twice."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecar.pipelines.files.report import read_report


class SourceRecording:
    """The part of a bag that a run was made of, as its report's inputs name it."""

    def __init__(self, inputs: Any) -> None:
        """What is no inputs of a run is of no recording that is known."""
        known: Mapping[str, Any] = inputs if isinstance(inputs, dict) else {}
        self._bag, self._part = known.get("bag_fingerprint"), known.get("part")
        self.is_all = known.get("continue") is None
        """Whether the map is of nothing else."""

    @classmethod
    def of_run(cls, folder: Path) -> "SourceRecording":
        """That of a run's folder."""
        return cls(read_report(folder).get("inputs"))

    def is_same_as(self, other: "SourceRecording") -> bool:
        """Whether both are known and the same, by the content of the bag."""
        return self._bag is not None and (self._bag, self._part) == (other._bag, other._part)
