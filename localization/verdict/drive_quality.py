"""The verdict on the poses of a drive, for people and programs."""

from dataclasses import dataclass
from enum import Enum
from math import isnan

from racecar.localization.verdict.unknown_segments import UnknownSegment, longest_of

_NAMED = 3
"""Segments named in the summary, so that it stays one line; reports have all."""


class DriveVerdict(str, Enum):
    """How the poses of a drive may be used."""

    LOCALIZED = "localized"
    UNCERTAIN = "uncertain"
    """Check before use."""
    LOST = "lost"


@dataclass(frozen=True, eq=False)
class DriveQuality:
    """How much of a drive the car's place was known on, and whether the map is the right one."""

    verdict: DriveVerdict
    known_share: float
    """Share of the drive's time, without pauses."""
    deviation: float
    """Mean standard deviation of the position in metres, where it is known; nan if it never is."""
    map_log_odds: float
    """Log-odds that the map is the right one."""
    reasons: tuple[str, ...]
    """Sentences for people, most important first; none for a localized drive."""
    segments: tuple[UnknownSegment, ...]
    """The longest segments, in time order."""

    @property
    def summary(self) -> str:
        """One line for people."""
        return " ".join([f"The drive is {self.verdict.value}: {self._extent}.", *self.reasons, *self._where])

    def as_dict(self) -> dict[str, object]:
        """The entry in reports."""
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
        if isnan(self.deviation):
            return "the car's place was never known"
        is_believed = self.verdict == DriveVerdict.LOCALIZED
        to = f", to some {max(self.deviation, 0.01):.2g} m" if is_believed else ""
        return (
            f"the car's place {'was' if is_believed else 'seemed'} known on {self.known_share:.0%} of it{to}"
        )

    @property
    def _where(self) -> list[str]:
        if not self.segments or self.verdict == DriveVerdict.LOST:
            return []
        named = longest_of(self.segments, _NAMED)
        further = len(self.segments) - len(named)
        more = f", and {further} more" if further else ""
        return [f"It was not {'; '.join(segment.words for segment in named)}{more}."]
