"""Which recording a run's map is of, so that none counts twice."""

import math
from os.path import realpath
from pathlib import Path

from racecar.pipelines.files.run_report import Inputs, read_report


class SourceRecording:
    """The part of a bag that a run was made of, as its report's inputs name it."""

    def __init__(self, inputs: Inputs) -> None:
        """Without any inputs it is of no recording that is known."""
        self._named = inputs.bag
        self.fingerprint = inputs.bag_fingerprint
        """Of the bag's content; None where the report does not hold it."""
        self._begin, duration = inputs.part.start, inputs.part.duration
        self._end = math.inf if duration is None else self._begin + duration
        self.is_all = inputs.continued is None
        """Whether the map is of nothing else."""

    @classmethod
    def of_run(cls, folder: Path) -> "SourceRecording":
        """That of a run's folder."""
        return cls(read_report(folder).inputs)

    def is_at_path_of(self, bag: Path) -> bool:
        """Whether it was read from there, whatever became of the file."""
        named = self._named
        return named is not None and "\0" not in named and realpath(named) == realpath(bag)

    def is_within(self, other: "SourceRecording") -> bool:
        """Whether all of it is known to be in another one, by the content of the bag."""
        is_same_bag = self.fingerprint is not None and self.fingerprint == other.fingerprint
        return is_same_bag and other._begin <= self._begin and self._end <= other._end
