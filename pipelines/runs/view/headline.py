"""The one line over a map: a verdict, or whether a car's place is known."""

import math
from typing import NamedTuple

from racecar.localization.pose_estimate import DOMINANT, PoseEstimate
from racecar.pipelines.files.tone import Tone

BLIND_AFTER = 1.0
"""Seconds without a scan after which the last pose is no longer shown as known: the slowest lasers scan
five times a second, and a car drives a metre or more meanwhile."""


class Headline(NamedTuple):
    """A few large words."""

    words: str
    tone: Tone = Tone.NEUTRAL
    below: str = ""
    """A line below them."""
    reasons: tuple[str, ...] = ()
    """Sentences that a click unfolds."""


def place_headline(estimate: PoseEstimate | None, silence: float) -> Headline:
    """Whether the car's place is known, ``silence`` seconds after the last scan with returns; infinite if
    there was none."""
    if estimate is None:
        return Headline("No pose yet", Tone.NEUTRAL, last_scan(silence))
    if silence > BLIND_AFTER:
        return Headline(f"Blind for {silence:.0f} s", Tone.BAD, "No scan says where the car is.")
    if estimate.is_lost:
        return Headline("Lost", Tone.BAD, f"Global localization; {last_scan(silence)}")
    place, degrees = estimate.deviation, math.degrees(math.sqrt(max(estimate.covariance[2, 2], 0.0)))
    sure = f"± {_length(place)}, ± {max(degrees, 0.1):.1f}°"
    if estimate.is_place_known:
        return Headline(f"Known {sure}", Tone.GOOD, last_scan(silence))
    if estimate.cluster_weight <= DOMINANT:
        below = f"At one of several places: drive on, or say where it is; {last_scan(silence)}"
        return Headline("Uncertain", Tone.DOUBTFUL, below)
    return Headline(f"Uncertain {sure}", Tone.DOUBTFUL, last_scan(silence))


def last_scan(silence: float) -> str:
    """The age of the last scan, in words."""
    return "no scan yet" if math.isinf(silence) else f"last scan {silence:.1f} s ago"


def _length(metres: float) -> str:
    """In centimetres below a metre, and never zero."""
    return f"{metres:.1f} m" if metres >= 0.995 else f"{max(100.0 * metres, 1.0):.0f} cm"
