"""The two filters that the experiments compare, started at a known pose."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.evaluation.course_filter import CourseFilter, CourseSettings
from racecar.pipelines.experiments.figure_style import COURSE, COURSE_NAME, OURS, OURS_NAME
from racecar.pipelines.experiments.tracking import Filter

COLORS: Mapping[str, str] = {OURS_NAME: OURS, COURSE_NAME: COURSE}
"""By name of the filter."""


def with_motion_noise(settings: LocalizationConfig, noise: float) -> LocalizationConfig:
    """All four of the motion model's noises set to one value, and no slip beside them."""
    return settings.model_copy(
        update={
            "turn_noise_per_turn": noise,
            "turn_noise_per_metre": noise,
            "path_noise_per_metre": noise,
            "path_noise_per_turn": noise,
            "slip": 0.0,
        }
    )


def start_filter(
    settings: LocalizationConfig | CourseSettings,
    grid: OccupancyGrid,
    map_from_base: Pose,
    deviations: tuple[float, float, float],
    rng: np.random.Generator,
) -> Filter:
    """The filter that has these settings, its particles spread normally about a pose (3,)."""
    covariance: NDArray[np.float64] = np.diag(np.square(deviations))
    filter_: Localizer | CourseFilter
    if isinstance(settings, CourseSettings):
        filter_ = CourseFilter(grid, settings, rng)
    else:
        filter_ = Localizer(grid, settings, rng)
    filter_.set_pose(map_from_base, covariance)
    return filter_
