"""Initial distributions of the pose."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace, Region
from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import BEYOND_ANY_MAP, as_pose
from racecar.maps.geometry.se2 import Pose


def draw_start(
    map_from_base: ArrayLike,
    covariance: ArrayLike | None,
    free_space: FreeSpace,
    config: LocalizationConfig,
    rng: np.random.Generator,
) -> Pose:
    """(N, 3) particles around a start pose (3,), in free space only, with its covariance (3, 3).

    The default spread is that of the settings. Raises UserError when the pose is not finite, off the map or
    far from free space, or the covariance is invalid.
    """
    pose = as_pose(map_from_base, "The initial pose")
    if covariance is None:
        drawn = draw_about(pose, config.particles, config, rng)
    else:
        drawn = pose + rng.standard_normal((config.particles, 3)) @ _root_of(covariance).T
    possible = drawn[free_space.contains(drawn[:, :2])]
    is_on_map = free_space.grid.contains(free_space.grid.cell_of(pose[None, :2]))[0]
    if len(possible) == 0 or not is_on_map:
        raise UserError(
            f"The initial pose ({pose[0]:.2f}, {pose[1]:.2f}) is not on the map's free space; "
            "give a pose where the car can stand, or use global localization."
        )
    return np.resize(possible, drawn.shape)


def region_about(point_in_map: NDArray[np.float64], radius: float, free_space: FreeSpace) -> Region:
    """The circle around a point (2,).

    Raises UserError when the car cannot stand there or a number is not finite.
    """
    point = np.asarray(point_in_map, dtype=np.float64)
    if point.shape != (2,) or not np.all(np.abs(point) < BEYOND_ANY_MAP) or not 0 < radius < BEYOND_ANY_MAP:
        raise UserError("The position is not two finite numbers and a radius; give them in metres.")
    region = Region(point, radius)
    if free_space.within(region).cell_count == 0:
        raise UserError(
            f"Within {radius:.2f} m of ({point[0]:.2f}, {point[1]:.2f}) is no free space of the map; "
            "give a place where the car can stand, or a larger radius."
        )
    return region


def draw_about(map_from_base: Pose, count: int, config: LocalizationConfig, rng: np.random.Generator) -> Pose:
    """(count, 3) particles drawn from a normal distribution around a pose (3,)."""
    spread = [config.start_spread, config.start_spread, config.start_heading_spread]
    drawn: Pose = map_from_base + spread * rng.standard_normal((count, 3))
    return drawn


def _root_of(covariance: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) matrix square root of a positive semi-definite covariance (3, 3), which may have zero axes."""
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape == (3, 3) and np.all(np.abs(matrix) < BEYOND_ANY_MAP):
        variances, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
        if variances.min() >= -1e-9 * max(variances.max(), 1.0):
            root: NDArray[np.float64] = axes * np.sqrt(np.maximum(variances, 0.0))
            return root
    raise UserError("The initial pose has no valid covariance: give 3 x 3 finite numbers of x, y and yaw.")
