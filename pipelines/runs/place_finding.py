"""Locate a drive on an earlier map: the localizer searches for it, keyframe by keyframe."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.verdict.map_fit import MapFit
from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.rendering import Rays
from racecar.mapping.session.drawing import Views, draw_map
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.config_file import Config
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_METRES_PER_SECOND, _RADIANS_PER_SECOND, _LEAST_SECONDS = 1.0, 1.0, 0.1
"""Assumed between keyframes, as a session stores no times. Chosen by judgement: walking pace."""
_BEYOND = 0.1
"""Metres that a laser is assumed to reach beyond its farthest return, because a session does not store its
limit. Chosen by judgement."""
_FIRST_STAMP = 1_000_000_000
"""Nanoseconds; not zero, because a stamp of zero counts as missing."""


def found_on(session: Session, config: Config, seed: int = 0, start: Pose | None = None) -> EarlierMap:
    """The map of a session with a search for later drives on it; they begin at the ``start`` (3,), or
    anywhere."""
    search = LocalizerSearch(session, config.mapping, config.localization, seed, start)
    return EarlierMap(session, search, is_start_given=start is not None)


@dataclass(frozen=True, eq=False)
class LocalizerSearch:
    """Locates a drive on the map of an earlier session."""

    earlier: Session
    mapping: MappingConfig
    localization: LocalizationConfig
    seed: int
    initial_pose: Pose | None
    """(3,) start of the drive on the earlier map; None searches the whole map."""

    def __call__(self, later: Session) -> Iterator[Pose | None]:
        """Yield the laser pose (3,) of each keyframe on the earlier map, or None where it is unknown; ends
        when the car is lost after a given start.

        Raises UserError when the map has nothing to localize on, or the given pose is not on it.
        """
        localizer = Localizer(self._grid(), self.localization, np.random.default_rng(self.seed))
        if self.initial_pose is not None:
            localizer.set_pose(self.initial_pose)
        reach = _reach(later.rays)
        base, fit, has_begun = later.map_from_base, MapFit(), False
        for k, stamp in enumerate(_stamps(base)):
            localizer.add_odometry(Odometry(int(stamp), base[k], np.zeros(3)))
            if later.rays[k].returns == 0:
                yield None
                continue
            laser_from_base = later.keyframe_from_base[k]
            estimate = localizer.add_scan(_scan(later.rays[k], int(stamp), inverse(laser_from_base), reach))
            if estimate.is_start and has_begun:
                if self.initial_pose is not None:
                    return
                fit = MapFit()
            has_begun = True
            fit.follow(estimate)
            is_known = estimate.is_place_known and fit.is_right
            yield compose(estimate.map_from_base, inverse(laser_from_base)) if is_known else None

    def _grid(self) -> OccupancyGrid:
        """Everything that the earlier drives saw, whatever part is configured to be drawn."""
        session, config = self.earlier, self.mapping
        rendering = config.rendering.model_copy(update={"crop": None, "left_out": ()})
        return draw_map(
            *(Views.of(session), session.keyframes, config.resolution, rendering),
            keep_frame=True,
        ).grid


def _stamps(base: Pose) -> NDArray[np.int64]:
    """(K,) nanoseconds at which a car at constant speed reaches poses (K, 3)."""
    steps = between(base[:-1], base[1:])
    metres, turn = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
    seconds = np.maximum(np.maximum(metres / _METRES_PER_SECOND, turn / _RADIANS_PER_SECOND), _LEAST_SECONDS)
    return np.asarray(_FIRST_STAMP + 1e9 * np.cumsum(np.append(0.0, seconds)), dtype=np.int64)


def _reach(rays: list[Rays]) -> float:
    """Range of the laser in metres, estimated from its farthest return."""
    farthest = [np.hypot(*each.ends[: each.returns].T).max() for each in rays if each.returns]
    return max(farthest, default=0.0) + _BEYOND


def _scan(rays: Rays, stamp: int, base_from_laser: Pose, reach: float) -> Scan:
    """A scan from stored rays, with one beam per direction."""
    ends = rays.ends.astype(np.float64)
    bearings, ranges = np.arctan2(ends[:, 1], ends[:, 0]), np.hypot(ends[:, 0], ends[:, 1])
    ranges[rays.returns :] = np.inf
    bearings, first = np.unique(bearings, return_index=True)
    return Scan(stamp, bearings, ranges[first], np.zeros(len(bearings)), base_from_laser, reach)
