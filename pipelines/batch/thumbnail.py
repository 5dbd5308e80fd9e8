"""A small picture of a map for a page of many."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from PIL import Image

_MOST_PIXELS = (440, 300)
"""Twice as many as are shown, for screens of fine pixels; some 15 kB as JPEG."""


@dataclass(frozen=True)
class Thumbnail:
    """A picture, and what it is a small one of."""

    shows: str
    """The name of a file in the run's folder."""
    jpeg: bytes


def map_thumbnail(folder: Path) -> Thumbnail | None:
    """Of map.png, or of the map itself where no picture was drawn; None where there is none."""
    for name in ("map.png", "map.pgm"):
        try:
            with Image.open(folder / name) as image:
                small = image.convert("RGB")
        except (OSError, Image.DecompressionBombError):
            continue
        small.thumbnail(_MOST_PIXELS)
        jpeg = BytesIO()
        small.save(jpeg, format="JPEG", quality=80)
        return Thumbnail(name, jpeg.getvalue())
    return None
