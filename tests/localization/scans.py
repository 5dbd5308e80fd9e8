"""End points as a standing car sees them."""

import numpy as np

from racecar.localization.sensor.end_points import EndPoints, select_points
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.sensors.scan import Scan
from tests.sensors.drives import BASE_FROM_LASER, BEARINGS


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
