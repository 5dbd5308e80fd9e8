"""Warnings about a map's figures and how far they can be trusted."""

from collections.abc import Sequence

import numpy as np

from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.maps.errors import UserError
from racecar.maps.grid.edits import Edit, covered
from racecar.maps.grid.occupancy_grid import OCCUPIED_THRESHOLD, OccupancyGrid
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import MOST_PIXELS
from racecar.pipelines.runs.evaluation.wall_fit import ON_WALL, WallFit
from racecar.pipelines.runs.mapping_drive import MappingDrive
from racecar.sensors.fixed_returns.left_out import LeftOut

_COARSE = 0.25
"""Metres; half the length of a small car. The error of walls in such cells is as large as a parked car."""
_CLUTTERED = 0.5
"""Share of a map near its walls above which a wrong pose would also have half of its end points on walls."""
_POOR_FIT = 0.5
"""Share of end points on walls below which a person should check the result."""
_ASTRAY = 0.05
"""Share of a path in walls or outside the map: none on our maps, and a tenth when the image was of another
run."""
_NAMED = 3
"""Number of sectors that a sentence names, to keep it short; report.json has all."""


def cautions_of_fixed_returns(left_out: LeftOut) -> list[str]:
    """For a recording with returns left out because they move with the laser."""
    if left_out.returns == 0:
        return []
    begin, end = left_out.seconds
    named, further = left_out.sectors[:_NAMED], len(left_out.sectors) - _NAMED
    sectors = "; ".join(
        f"{each.begin:.0f}° to {each.end:.0f}°, {each.nearest:.1f} to {each.farthest:.1f} m" for each in named
    )
    sectors += f"; and {further} more" if further > 0 else ""
    return [
        f"{left_out.share:.0%} of the returns between {begin:.0f} and {end:.0f} s after the first scan move "
        "along with the laser, such as the robot's own parts, whoever carries it, or the floor that a "
        f"tilted laser sees ({sectors}; 0° is where the laser looks): they were left out. Clear the laser's "
        "view, or level it, unless the robot was carried."
    ]


def cautions_of_resolution(resolution: float) -> list[str]:
    """For a map with cells of ``resolution`` metres."""
    if resolution <= _COARSE:
        return []
    return [
        f"The map's cells are {resolution:g} m wide, so walls and poses are known no better than that; 0.05 "
        "is usual."
    ]


def cautions_of_size(grid: TiledGrid) -> list[str]:
    """For a map whose image is too large to be read back."""
    if grid.size <= MOST_PIXELS:
        return []
    return [
        f"The map has {grid.width} × {grid.height} cells, too many to localize on it, to look at it in the "
        f"studio or to draw its walls; for that, render it with cells of {grid.coarser(MOST_PIXELS):g} m "
        "(racecar render --resolution), or a part of it (--crop)."
    ]


def cautions_of_edits(grid: TiledGrid, edits: Sequence[Edit]) -> list[str]:
    """For a map that is not cropped, with edits drawn over it."""
    return [
        f"Edit {n}, {edit.kind}, lies outside the map, so that it changes nothing; are its points in metres, "
        "in the map's frame?"
        for n, edit in enumerate(edits, start=1)
        if not any(covered(grid, edit))
    ]


def cautions_of_walls(walls: WallFit) -> list[str]:
    """For a map on which end points are compared with the walls."""
    if walls.share_of_map <= _CLUTTERED:
        return []
    return [
        f"{walls.share_of_map:.0%} of the map lies within {ON_WALL:.2f} m of a wall, so that end points on "
        "walls do not show that the pose is right; look at overlay.png, and at negate and the thresholds."
    ]


def cautions_of_path(grid: OccupancyGrid, drive: MappingDrive) -> list[str]:
    """For a map beside the path of a drive, when the two do not match."""
    try:
        driven = drive.trajectory()
    except UserError:
        return []
    cells = grid.cell_of(driven.map_from_base[:, :2])
    is_inside = grid.contains(cells)
    is_astray = ~is_inside
    is_astray[is_inside] = grid.cells[tuple(cells[is_inside].T)] >= 100.0 * OCCUPIED_THRESHOLD
    share = float(np.mean(is_astray))
    if share <= _ASTRAY:
        return []
    return [
        f"{share:.0%} of the path in trajectory.tum beside the map lies in walls or beyond the map's edge: "
        "unless it was cropped or edited so, the files there are of different runs, so map the bag again."
    ]


def cautions_of_fit(share: float, verdict: DriveVerdict) -> list[str]:
    """For a drive with only a ``share`` of its end points on walls. A verdict that the car is lost already
    says so, and a verdict that it is localized must not be contradicted."""
    why = {
        DriveVerdict.LOCALIZED: "much has changed since it was made, or hides it",
        DriveVerdict.UNCERTAIN: "it is the wrong map, outdated, or the car was lost",
    }
    if share >= _POOR_FIT or verdict not in why:
        return []
    points = f"Only {share:.0%} of the scans' end points lie on walls of the map"
    return [f"{points}: {why[verdict]}; look at overlay.png."]
