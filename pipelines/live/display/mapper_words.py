"""How the map grows, in words for the page."""

from collections.abc import Sequence

from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.state.growth import Growth
from racecar.pipelines.files.literal_markdown import literal


def mapper_words(growth: Growth | None, quality: MapQuality | None, wrong: Sequence[str]) -> str:
    """Paragraphs of Markdown: how much is mapped, what the map is worth so far, and what is wrong at the
    moment."""
    if growth is None:
        return "\n\n".join(["There is no map yet.", *map(literal, wrong)])
    keyframes, loops = _counted(growth.keyframes, "keyframe"), _counted(growth.loops, "loop")
    extent = f"**{growth.metres:.0f} m** driven, {keyframes}, {loops} closed."
    verdict = "The map is judged once a minute." if quality is None else f"So far: {literal(quality.summary)}"
    return "\n\n".join([extent, verdict, *map(literal, wrong)])


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
