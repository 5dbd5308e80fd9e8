"""Possible problems of a bag, by name and numbers; `sentences` puts them into words for the user."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.grades import GRADES, Grade
from racecar.sensors.sentences import COUNTED, SENTENCES


@dataclass(frozen=True, init=False)
class Finding:
    """A problem with a bag."""

    name: str
    spoils_map: bool
    """A map made from the bag as it is would be wrong, or could not be made at all."""
    numbers: dict[str, Any]
    """The numbers in its sentence."""

    def __init__(self, name: str, *, spoils_map: bool = False, **numbers: Any) -> None:
        for field, value in (("name", name), ("spoils_map", spoils_map), ("numbers", numbers)):
            object.__setattr__(self, field, value)

    @property
    def grade(self) -> Grade:
        """What it means for a map made from the bag as it is."""
        if self.spoils_map:
            return Grade.SPOILS_MAP
        return GRADES.get(self.name, Grade.MAY_SPOIL_MAP)

    @property
    def what(self) -> str:
        """What is wrong."""
        return self._words[0]

    @property
    def remedy(self) -> str:
        """What to do about it."""
        return self._words[1]

    @property
    def sentence(self) -> str:
        """What is wrong and what to do about it."""
        return " ".join(self._words).rstrip()

    @property
    def warning(self) -> str:
        """The sentence, after its grade in brackets."""
        return f"[{self.grade.value}] {self.sentence}"

    def as_dict(self) -> dict[str, Any]:
        """The finding for a JSON file."""
        return {
            "name": self.name,
            "what": self.what,
            "remedy": self.remedy,
            "grade": self.grade.value,
            "spoils_map": self.spoils_map,
        }

    @property
    def _words(self) -> tuple[str, str]:
        sentences = SENTENCES[self.name]
        if callable(sentences):
            return sentences(**self.numbers)
        what, remedy = sentences
        return what.format(**self.numbers), remedy.format(**self.numbers)


def times(count: int) -> str:
    """For example "once", "twice" and "3 times"."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def in_words(pose: Pose) -> str:
    """A pose (3,) in words for the user."""
    return f"x {pose[0]:.2f} m, y {pose[1]:.2f} m, yaw {np.degrees(pose[2]):.0f}°"


_LOST = (
    "dropped_out_of_order",
    "empty_scans",
    "scans_beyond_one_turn",
    "undecodable_messages",
    "oversized_messages",
)
"""Counts of messages missing from the map."""
_MUCH_LOST = 0.25
"""Share of all messages. Chosen by judgement: a drive that loses more has gaps that no odometry bridges."""


def counted_findings(counts: Counter[str]) -> list[Finding]:
    """Findings on what was corrected or dropped while reading."""
    lost = sum(counts[name] for name in _LOST)
    is_much = lost > _MUCH_LOST * (lost + counts["scans"] + counts["odometry"])
    findings = [
        Finding(name, spoils_map=is_much and name in _LOST, count=counts[name])
        for name in COUNTED
        if counts[name]
    ]
    lacking = counts["scans_without_odometry"]
    if lacking > 0.01 * counts["scans"] + 2:
        findings.append(Finding("scans_without_odometry", count=lacking, scans=counts["scans"]))
    return findings
