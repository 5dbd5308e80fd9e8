"""What is drawn while a map is edited: the map as it will be written, and the outlines of its edits."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.maps.grid.edits import Edit, edited, keepout_mask, speed_mask
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import as_written
from racecar.pipelines.studio.edit.kinds import KINDS
from racecar.pipelines.studio.map_image import MapImage, paint
from racecar.pipelines.studio.palette import Backdrop, Color


def paint_edited(
    grid: TiledGrid, edits: Sequence[Edit], rendering: RenderingConfig, ground: Backdrop
) -> MapImage:
    """The cells as they will be written, tinted where robots shall be slow or keep out."""
    written = as_written(
        edited(grid, edits),
        mode=rendering.mode,
        occupied_threshold=rendering.occupied_threshold,
        free_threshold=rendering.free_threshold,
    )
    kinds = {edit.kind for edit in edits}
    tints: list[tuple[TiledGrid, Color]] = []
    if "speed" in kinds:
        tints.append((speed_mask(grid, edits)[0], KINDS["speed"].color))
    if "keepout" in kinds:
        tints.append((keepout_mask(grid, edits), KINDS["keepout"].color))
    return paint(written, ground, tints)


def outlines(edits: Sequence[Edit]) -> NDArray[np.float64]:
    """(N, 2, 2) the lines between the corners of each; those of a wall do not lead back."""
    return np.concatenate([np.zeros((0, 2, 2)), *(_outline(edit) for edit in edits)])


def _outline(edit: Edit) -> NDArray[np.float64]:
    ends = np.stack([edit.points, np.roll(edit.points, -1, axis=0)], axis=1)
    return ends[:-1] if edit.kind == "wall" else ends
