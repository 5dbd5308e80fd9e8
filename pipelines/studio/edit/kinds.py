"""The kinds of edits, as the page names, explains and colours them."""

from typing import NamedTuple

from racecar.maps.grid.edits import EditKind
from racecar.pipelines.studio.palette import CAR, LOOP, PARTICLE, SCAN, SKY, TRUTH, Color


class KindOnPage(NamedTuple):
    """A kind of edit."""

    name: str
    help: str
    color: Color


KINDS: dict[EditKind, KindOnPage] = {
    "erase": KindOnPage("Erase", "What was seen inside becomes free: a chair, a person.", CAR),
    "wall": KindOnPage("Wall", "A wall from corner to corner.", PARTICLE),
    "free": KindOnPage("Free", "All inside becomes free, even what nobody saw.", SKY),
    "unknown": KindOnPage("Unknown", "All inside becomes unknown.", TRUTH),
    "keepout": KindOnPage("Keep out", "No robot shall go there; the map stays as it is.", LOOP),
    "speed": KindOnPage("Speed limit", "Robots shall be slow there; the map stays as it is.", SCAN),
}

KIND_OF_NAME = {kind.name: key for key, kind in KINDS.items()}
