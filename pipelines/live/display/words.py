"""The state of the nodes in words, for the page."""

import math
from collections.abc import Sequence

from racecar.localization.pose_estimate import DOMINANT, PoseEstimate
from racecar.localization.verdict.drive_quality import DriveQuality
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.state.growth import Growth
from racecar.pipelines.files.literal_markdown import literal


def localizer_words(estimate: PoseEstimate | None, drive: DriveQuality, wrong: Sequence[str]) -> str:
    """Paragraphs of Markdown: whether and how well the place is known, the verdict on the drive, and current
    faults."""
    if estimate is None:
        return "\n\n".join(["There is no pose yet.", *map(literal, wrong)])
    so_far = " ".join([f"The drive so far is {drive.verdict.value}.", *map(literal, drive.reasons[:1])])
    return "\n\n".join([_place_words(estimate), so_far, *map(literal, wrong)])


def _place_words(estimate: PoseEstimate) -> str:
    place, degrees = estimate.deviation, math.degrees(math.sqrt(max(estimate.covariance[2, 2], 0.0)))
    sure = f"± {_length(place)}, ± {max(degrees, 0.1):.1f}°"
    if estimate.is_lost:
        return "**The car is lost**, and searched for on the whole map."
    if estimate.is_place_known:
        return f"**The place is known**: {sure}."
    if estimate.cluster_weight <= DOMINANT:
        return "**The car is being searched for**: it may be at several places. Drive on, or say where it is."
    return f"**The place is known roughly**: {sure}."


def _length(metres: float) -> str:
    """In centimetres below a metre, and never zero."""
    return f"{metres:.1f} m" if metres >= 0.995 else f"{max(100.0 * metres, 1.0):.0f} cm"


def mapper_words(growth: Growth | None, quality: MapQuality | None, wrong: Sequence[str]) -> str:
    """Paragraphs of Markdown: how much is mapped, the verdict on the map so far, and current faults."""
    if growth is None:
        return "\n\n".join(["There is no map yet.", *map(literal, wrong)])
    keyframes, loops = _counted(growth.keyframes, "keyframe"), _counted(growth.loops, "loop")
    extent = f"**{growth.metres:.0f} m** driven, {keyframes}, {loops} closed."
    verdict = "The map is judged once a minute." if quality is None else f"So far: {literal(quality.summary)}"
    return "\n\n".join([extent, verdict, *map(literal, wrong)])


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
