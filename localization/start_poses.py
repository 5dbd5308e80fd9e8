"""Where the particles are before any scan: about a pose, or anywhere."""

import numpy as np

from localization.config import LocalizationConfig
from localization.free_space import FreeSpace
from maps.errors import UserError
from maps.se2 import Pose

_PARTICLES_PER_SQUARE_METRE = 400
_MOST_PARTICLES = 1_000_000
_BEYOND_ANY_MAP = 1e9


def draw_start(
    map_from_base: Pose, free_space: FreeSpace, config: LocalizationConfig, rng: np.random.Generator
) -> Pose:
    """(N, 3) particles about a start pose (3,), on free space only.

    Raises UserError when the pose is not finite, off the map or far from free space.
    """
    pose = np.asarray(map_from_base, dtype=np.float64)
    if not np.all(np.abs(pose) < _BEYOND_ANY_MAP):
        raise UserError(
            "The initial pose is not three finite numbers; give x and y in metres and yaw in radians."
        )
    drawn = draw_about(pose, config.particles, config, rng)
    possible = drawn[free_space.contains(drawn[:, :2])]
    is_on_map = free_space.grid.contains(free_space.grid.cell_of(pose[None, :2]))[0]
    if len(possible) == 0 or not is_on_map:
        raise UserError(
            f"The initial pose ({pose[0]:.2f}, {pose[1]:.2f}) is not on the map's free space; "
            "give a pose where the car can stand, or search the whole map."
        )
    return np.resize(possible, drawn.shape)


def draw_about(map_from_base: Pose, count: int, config: LocalizationConfig, rng: np.random.Generator) -> Pose:
    """(count, 3) particles spread normally about a pose (3,)."""
    spread = [config.start_spread, config.start_spread, config.start_heading_spread]
    drawn: Pose = map_from_base + spread * rng.standard_normal((count, 3))
    return drawn


def draw_anywhere(free_space: FreeSpace, config: LocalizationConfig, rng: np.random.Generator) -> Pose:
    """(N, 3) particles over the whole map, as many as it takes for one to be near the car."""
    area = free_space.cell_count * free_space.grid.resolution**2
    wanted = min(int(area * _PARTICLES_PER_SQUARE_METRE), _MOST_PARTICLES)
    return free_space.draw_poses(max(wanted, config.scattered_particles), rng)
