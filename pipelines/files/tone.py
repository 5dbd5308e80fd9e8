"""How good a verdict is, which becomes a colour on pages and pictures."""

from enum import Enum


class Tone(Enum):
    """How good something is."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    BAD = "bad"
    NEUTRAL = "neutral"


TONE_OF_VERDICT = {
    "good": Tone.GOOD,
    "doubtful": Tone.DOUBTFUL,
    "wrong": Tone.BAD,
    "localized": Tone.GOOD,
    "uncertain": Tone.DOUBTFUL,
    "lost": Tone.BAD,
}
"""By the words of the verdicts on a map, and on a drive."""
