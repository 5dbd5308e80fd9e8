"""Floor plans as images: the outlines of what differs from the paper are the faces of walls."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from racecar.mapping.mending.floor_plan import FloorPlan, lines_of
from racecar.maps.map_files import open_image

_MOST_PIXELS = 16_000_000
"""Pixels of larger images are joined, since outlines take some bytes of each. Chosen by judgement: 2.5 cm per
pixel for 100 m of building."""
_STAIRS = 0.75
"""Pixels by which a line may deviate from an outline, whose steps along slanted walls are half a pixel
high."""
_LEAST_OUTLINE = 6
"""Points of an outline, at least, because a single dark pixel has five."""


def read_plan_image(path: Path) -> FloorPlan:
    """Read an image. Raises UserError when it is none."""
    shades = _on_paper(open_image(path, f"The floor plan {path}"))
    step = int(np.ceil(np.sqrt(shades.width * shades.height / _MOST_PIXELS)))
    pixels = np.asarray(shades.reduce(step))[::-1].astype(np.int16)
    contrast = np.abs(pixels - int(np.median(pixels)))  # light lines on dark paper, too
    lines = lines_of([step * outline for outline in _outlines(contrast)])
    along = lines[:, 1] - lines[:, 0]
    faces = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    darkness = np.rint(contrast * (100.0 / max(int(contrast.max()), 1))).astype(np.int8)
    return FloorPlan(path.name, lines, faces, "pixel", top=float(step * len(pixels)), darkness=darkness)


def _on_paper(image: Image.Image) -> Image.Image:
    """Shades of grey, where transparent pixels are white."""
    if image.mode.startswith("I"):
        image = Image.fromarray((np.clip(np.asarray(image), 0, 65535) // 256).astype(np.uint8))
    if "A" not in image.getbands() and "transparency" not in image.info:
        return image.convert("L")
    paper = Image.new("RGBA", image.size, "white")
    return Image.alpha_composite(paper, image.convert("RGBA")).convert("L")


def _outlines(contrast: NDArray[np.int16]) -> list[NDArray[np.float64]]:
    """Polylines (N, 2) in pixels around what has more than half of the contrast, on their right."""
    import shapely
    from skimage.measure import find_contours  # slow to import, and few commands need it

    level = max(float(contrast.max()) / 2.0, 0.5)
    found = find_contours(np.pad(contrast, 1), level, positive_orientation="high")
    outlines = [outline[:, ::-1] - 0.5 for outline in found if len(outline) >= _LEAST_OUTLINE]
    simple = shapely.simplify([shapely.LineString(outline) for outline in outlines], _STAIRS)
    return [np.array(line.coords) for line in simple]
