"""The state of the nodes in words, for the page."""

import math
from collections.abc import Sequence

from racecar.localization.verdict.drive_quality import DriveQuality
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.state.growth import Growth
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.files.tone import TONE_OF_VERDICT, Tone
from racecar.pipelines.runs.view.headline import BLIND_AFTER, Headline, last_scan


def localizer_words(drive: DriveQuality | None, wrong: Sequence[str]) -> str:
    """Paragraphs of Markdown: the verdict on the drive, once it has begun, and current faults."""
    so_far = []
    if drive is not None:
        so_far = [" ".join([f"The drive so far is {drive.verdict.value}.", *map(literal, drive.reasons[:1])])]
    return "\n\n".join([*so_far, *map(literal, wrong)])


def mapper_headline(quality: MapQuality | None, silence: float) -> Headline:
    """The verdict on the map so far, ``silence`` seconds after the last scan (infinite if there was none)."""
    if BLIND_AFTER < silence < math.inf:
        return Headline(f"Blind for {silence:.0f} s", Tone.BAD, "No scan arrives, and the map does not grow.")
    if quality is None:
        return Headline("Mapping", Tone.NEUTRAL, last_scan(silence))
    word = quality.verdict.value
    head = f"The map so far is {word}"
    return Headline(head, TONE_OF_VERDICT[word], last_scan(silence), quality.reasons)


def mapper_words(growth: Growth | None, quality: MapQuality | None, wrong: Sequence[str]) -> str:
    """Paragraphs of Markdown: how much is mapped, the verdict on the map so far, and current faults."""
    if growth is None:
        return "\n\n".join(["There is no map yet.", *map(literal, wrong)])
    keyframes, loops = _counted(growth.keyframes, "keyframe"), _counted(growth.loops, "loop closure")
    extent = f"**{growth.metres:.0f} m** driven, {keyframes}, {loops}."
    verdict = "The map is judged once a minute." if quality is None else f"So far: {literal(quality.summary)}"
    return "\n\n".join([extent, verdict, *map(literal, wrong)])


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
