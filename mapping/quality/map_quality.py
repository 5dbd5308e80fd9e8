"""The verdict on a finished map, for people and programs."""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Verdict(str, Enum):
    """What a map may be used for."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    """Check before use."""
    WRONG = "wrong"


@dataclass(frozen=True, eq=False)
class DoubtfulSegment:
    """A part of the path with evidence against it."""

    why: str
    """A sentence for people, with time and place."""
    keyframes: tuple[int, int]
    """First and last keyframe."""
    place: NDArray[np.float64]
    """(2,) metres in the map, at its middle."""
    seconds: tuple[float, float]
    """Seconds since the begin of the recording."""
    contradicted_by: tuple[int, int] | None = None
    """First and last keyframe of another pass that disagrees."""

    def shifted(self, keyframes: int) -> "DoubtfulSegment":
        """The same with indices increased by ``keyframes``."""
        runs = (self.keyframes, self.contradicted_by)
        own, other = (None if run is None else (run[0] + keyframes, run[1] + keyframes) for run in runs)
        return replace(self, keyframes=own or self.keyframes, contradicted_by=other)

    def as_dict(self) -> dict[str, object]:
        """The entry in reports."""
        return {
            "why": self.why,
            "x_m": float(self.place[0]),
            "y_m": float(self.place[1]),
            "from_s": self.seconds[0],
            "to_s": self.seconds[1],
            "keyframes": list(self.keyframes),
            "contradicted_by_keyframes": None if self.contradicted_by is None else list(self.contradicted_by),
        }


@dataclass(frozen=True, eq=False)
class MapQuality:
    """How far a map may be off, why, and where."""

    verdict: Verdict
    error_per_10_m: float
    """Expected error in metres between two places 10 m of path apart, or of one place between two passes,
    whichever is larger."""
    error_of_whole: float
    """Expected error in metres between any two places of the path."""
    reasons: tuple[str, ...]
    """Sentences for people, most important first; none for a good map."""
    segments: tuple[DoubtfulSegment, ...]
    """Most important first."""
    statistics: dict[str, float]
    """The measured statistics; NaN where there was nothing to measure."""
    doubts: tuple[str, ...] = ()
    """The first of the reasons: those not covered by the expected errors."""

    @property
    def summary(self) -> str:
        """One line for people."""
        expected = (
            f"expect errors of about {_rounded(self.error_per_10_m)} m per 10 m of path, "
            f"and {_rounded(self.error_of_whole)} m over the whole map"
        )
        if self.verdict == Verdict.GOOD:
            return f"The map is good: {expected}."
        is_map, where = f"The map is {self.verdict.value}:", [segment.why for segment in self.segments[:1]]
        if self.doubts:
            doubt = self.doubts[0]
            return " ".join([is_map, doubt[0].lower() + doubt[1:], f"Otherwise {expected}.", *where])
        return " ".join(dict.fromkeys([is_map, f"{expected}.", *self.reasons[:1], *where]))

    @property
    def caution(self) -> str:
        """The summary of a map that is not good, to be shown with it; else empty."""
        return "" if self.verdict == Verdict.GOOD else self.summary

    def as_dict(self) -> dict[str, object]:
        """The entry in reports."""
        return {
            "verdict": self.verdict.value,
            "error_per_10_m": self.error_per_10_m,
            "error_of_whole_m": self.error_of_whole,
            "reasons": list(self.reasons),
            "segments": [segment.as_dict() for segment in self.segments],
            "statistics": self.statistics,
        }


def _rounded(metres: float) -> str:
    """Rounded to one significant digit, at most to centimetres."""
    return f"{max(metres, 0.01):.2g}"
