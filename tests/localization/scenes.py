"""Places on maps, bare or furnished, and what a standing car sees there."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.localization.sensor.end_points import EndPoints, select_points
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.sensors.scan import Scan
from tests.sensors.drives import BASE_FROM_LASER, BEARINGS

HALF_WIDTH = 1.2
"""Metres, of corridors."""
_HALF_SIZE = 16.0
SIGHT = 12.0
"""Metres; less than to either end from within some metres of the middle."""
MIDDLE = np.array([5.0, 4.0])
"""Of the hall, metres in the grid's frame."""
Mask = NDArray[np.bool_]


def points_at(ranges: np.ndarray, base_from_laser: Pose = BASE_FROM_LASER) -> EndPoints:
    """Where beams at `BEARINGS` end, those that meet something."""
    scan = Scan(0, BEARINGS, ranges, np.zeros(len(ranges)), base_from_laser, 30.0)
    return select_points(scan, len(ranges), lambda stamps: np.zeros((len(stamps), 3)))


def ranges_from(grid: OccupancyGrid, pose: Pose, base_from_laser: Pose = BASE_FROM_LASER) -> np.ndarray:
    """(271,) what the map says that is measured at `BEARINGS` from a pose of the base."""
    return cast_ray_fan(grid, compose(pose, base_from_laser)[None], BEARINGS, 30.0)[0]


def points_from(grid: OccupancyGrid, pose: Pose, base_from_laser: Pose = BASE_FROM_LASER) -> EndPoints:
    """Likewise, the end points."""
    return points_at(ranges_from(grid, pose, base_from_laser), base_from_laser)


def slanted_corridor(
    degrees: float, resolution: float, *, thickness: float = 0.2, with_doors: bool = False
) -> OccupancyGrid:
    """32 m square with the corridor through its middle, which is the map's origin.

    Its walls have a thickness in metres, and the doors are gaps of a metre in both.
    """
    count = round(2.0 * _HALF_SIZE / resolution)
    y, x = (np.indices((count, count)) + 0.5) * resolution - _HALF_SIZE
    yaw = np.radians(degrees)
    along, across = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
    is_wall = (np.abs(across) >= HALF_WIDTH) & (np.abs(across) < HALF_WIDTH + thickness)
    if with_doors:
        is_wall &= (np.abs(along - 2.0) > 0.5) & (np.abs(along + 1.0) > 0.5)
    cells = np.where(is_wall, OCCUPIED, FREE).astype(np.int8)
    return OccupancyGrid(cells, resolution, np.array([-_HALF_SIZE, -_HALF_SIZE, 0.0]))


def seen_in_corridor(
    degrees: float, along: float, across: float, rng: np.random.Generator
) -> tuple[Pose, EndPoints]:
    """Where the car is, facing along, and what it sees of ideal bare walls, to within a centimetre."""
    bearings = np.linspace(-2.35, 2.35, 100)
    to_wall = np.where(bearings > 0.0, HALF_WIDTH - across, HALF_WIDTH + across)
    ranges = to_wall / np.abs(np.sin(bearings)) + rng.normal(0.0, 0.01, len(bearings))
    met = ranges <= SIGHT
    ends = ranges[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    pose = compose(np.array([0.0, 0.0, np.radians(degrees)]), [along, across, 0.0])
    return pose, EndPoints(ends[met], np.zeros(2))


def hall() -> OccupancyGrid:
    """10 x 8 m; the map frame is turned against the grid."""
    cells = np.full((80, 100), FREE, dtype=np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return OccupancyGrid(cells, 0.1, np.array([3.0, -2.0, 2.0]))


def furnished(grid: OccupancyGrid, mask: Mask) -> OccupancyGrid:
    """The grid with an obstacle on the cells of a mask (rows, columns)."""
    return replace(grid, cells=np.where(mask, np.int8(OCCUPIED), grid.cells))


def rectangle(
    grid: OccupancyGrid, center: NDArray[np.float64], length: float, width: float, yaw: float
) -> Mask:
    """(rows, columns) the cells within a rectangle about a point (2,), all in the grid's frame."""
    rows, columns = np.indices(grid.cells.shape)
    x, y = (columns + 0.5) * grid.resolution - center[0], (rows + 0.5) * grid.resolution - center[1]
    along, across = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
    inside: Mask = (np.abs(along) <= length / 2) & (np.abs(across) <= width / 2)
    return inside


def corner(grid: OccupancyGrid, yaw: float) -> Mask:
    """(rows, columns) the cells of an L with arms of 1.6 m, about the middle of the hall."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    other = MIDDLE + np.array([-0.5 * cos - 0.5 * sin, -0.5 * sin + 0.5 * cos])
    arm = rectangle(grid, MIDDLE, 1.6, 0.6, yaw)
    return arm | rectangle(grid, other, 0.6, 1.6, yaw)
