"""The verdict on the poses of a drive, for people and for programs."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

_NAMED = 3
"""Segments that the summary names, so that it stays one line; reports have all."""


class DriveVerdict(str, Enum):
    """What the poses of a drive may be used for."""

    LOCALIZED = "localized"
    UNCERTAIN = "uncertain"
    """To be looked at before they are used."""
    LOST = "lost"


@dataclass(frozen=True, eq=False)
class UnknownSegment:
    """A part of the drive on which the car's place was not known."""

    seconds: tuple[float, float]
    """Since the drive began."""
    place: NDArray[np.float64]
    """(2,) metres in the map, where the car was taken to be at its beginning."""
    is_lost: bool
    """Whether the car was rather elsewhere; else several places were possible, or a wide one."""

    @property
    def words(self) -> str:
        """For people."""
        begin, end = self.seconds
        when = f"at {begin:.0f} s" if end - begin < 1.0 else f"at {begin:.0f} to {end:.0f} s"
        return f"{when} near x {self.place[0]:.1f} m, y {self.place[1]:.1f} m"

    def as_dict(self) -> dict[str, object]:
        """For reports."""
        return {
            "from_s": self.seconds[0],
            "to_s": self.seconds[1],
            "x_m": float(self.place[0]),
            "y_m": float(self.place[1]),
            "lost": self.is_lost,
        }


@dataclass(frozen=True, eq=False)
class DriveQuality:
    """How much of a drive the car's place was known on, and whether the map is the right one."""

    verdict: DriveVerdict
    known_share: float
    """Of the drive's time, without pauses."""
    deviation: float
    """Metres of standard deviation of the place on average, where it is known; nan when it never is."""
    map_log_odds: float
    """That the map is the right one."""
    reasons: tuple[str, ...]
    """Sentences for people, the weightiest first; none of a drive that is localized."""
    segments: tuple[UnknownSegment, ...]
    """The longest, in the order of time."""

    @property
    def summary(self) -> str:
        """One line for people."""
        return " ".join([f"The drive is {self.verdict.value}: {self._extent}.", *self.reasons, *self._where])

    def as_dict(self) -> dict[str, object]:
        """For reports."""
        return {
            "verdict": self.verdict.value,
            "known_share": self.known_share,
            "deviation_m": self.deviation,
            "map_log_odds": self.map_log_odds,
            "reasons": list(self.reasons),
            "segments": [segment.as_dict() for segment in self.segments],
        }

    @property
    def _extent(self) -> str:
        if np.isnan(self.deviation):
            return "the car's place was never known"
        is_believed = self.verdict != DriveVerdict.LOST
        to = f", to some {max(self.deviation, 0.01):.2g} m" if is_believed else ""
        return (
            f"the car's place {'was' if is_believed else 'seemed'} known on {self.known_share:.0%} of it{to}"
        )

    @property
    def _where(self) -> list[str]:
        if not self.segments or self.verdict == DriveVerdict.LOST:
            return []
        longest = sorted(self.segments, key=lambda segment: segment.seconds[0] - segment.seconds[1])[:_NAMED]
        named = sorted(longest, key=lambda segment: segment.seconds)
        further = len(self.segments) - len(named)
        more = f", and {further} more" if further else ""
        return [f"It was not {'; '.join(segment.words for segment in named)}{more}."]
