"""Draw the map as configured: rotated, cropped, shifted to its origin, with scans left out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.despeckling import despeckled
from racecar.mapping.grid.near_path import near_path
from racecar.mapping.grid.rendering import Box, Rays, bounds_of, render, returns_of, seen_box
from racecar.mapping.session.session import Session
from racecar.mapping.session.wall_direction import wall_direction
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.sensors.matching.scan_store import ScanStore

_FRAME_IS_KEPT = (
    "The map was carried on in the frame that it has, so it was neither turned nor given another origin: "
    "render it again for that."
)


@dataclass(frozen=True, eq=False)
class Views:
    """What scans showed: rays with poses, of keyframes, then of scans between where keyframes are few."""

    rays: Sequence[Rays]
    """(S)"""
    map_from_laser: Pose
    """(S, 3)"""
    seconds: NDArray[np.float64]
    """(S,) seconds since the last recording began; NaN in earlier ones."""
    drives: NDArray[np.int32]
    """(S,) drive of each scan, in time order; later ones win."""
    keyframes: int
    """Number of keyframes among them."""

    @classmethod
    def of(cls, session: Session) -> "Views":
        """Those of the keyframes of a session."""
        times = session.times
        seconds = np.where(times.are_of_last, times.seconds, np.nan)
        return cls(session.rays, session.map_from_keyframe, seconds, times.drives, len(session.rays))

    def only(self, chosen: NDArray[np.bool_]) -> "Views":
        """The selected ones (S,)."""
        rays = [rays for rays, is_chosen in zip(self.rays, chosen.tolist(), strict=True) if is_chosen]
        keyframes = int(np.sum(chosen[: self.keyframes]))
        return Views(rays, self.map_from_laser[chosen], self.seconds[chosen], self.drives[chosen], keyframes)

    @property
    def path(self) -> NDArray[np.float64]:
        """(K, 2) positions of the laser at the keyframes, in metres."""
        return self.map_from_laser[: self.keyframes, :2]


@dataclass(frozen=True, eq=False)
class DrawnMap:
    """A grid and its frame."""

    tiled: TiledGrid
    drawn_from_map: Pose | None
    """(3,) pose of the scans' frame in that of the grid; None if they are the same."""
    disregarded: tuple[str, ...]
    """Sentences on settings that could not be applied, or left nothing to draw."""

    @cached_property
    def grid(self) -> OccupancyGrid:
        """The grid as one array. Raises UserError when it is too large."""
        return self.tiled.in_one_piece()


def draw_map(
    views: Views,
    store: ScanStore,
    resolution: float,
    rendering: RenderingConfig,
    *,
    keep_frame: bool = False,
) -> DrawnMap:
    """Draw scans, whose lines are in ``store``, with cells of ``resolution`` metres.

    With ``keep_frame`` the map is neither rotated nor shifted to another origin.
    """
    turn = 0.0 if keep_frame else _turn(views, store, rendering)
    if turn:
        turned = compose(np.array([0.0, 0.0, turn]), views.map_from_laser)
        views = replace(views, map_from_laser=turned)
    shown, not_left_out = _without_left_out(views, rendering)
    box, not_cropped = _box(shown, rendering)
    grid = render(shown.rays, shown.map_from_laser, shown.drives, resolution, rendering, box)
    of_keyframes = returns_of(shown.rays[: shown.keyframes], shown.map_from_laser[: shown.keyframes])
    grid = despeckled(grid, of_keyframes, shown.keyframes, rendering.largest_speck)
    if rendering.crop == "driven":
        grid = near_path(grid, shown.path, rendering.driven_margin)
    shift = np.zeros(2) if keep_frame else _shift(grid, rendering)
    if shift.any():
        grid = replace(grid, map_from_grid=grid.map_from_grid + np.append(shift, 0.0))
    frame = np.append(shift, turn)
    is_kept = keep_frame and (rendering.turn != 0.0 or rendering.origin is not None)
    kept = [_FRAME_IS_KEPT] if is_kept else []
    return DrawnMap(grid, frame if frame.any() else None, (*not_left_out, *not_cropped, *kept))


def _turn(views: Views, store: ScanStore, rendering: RenderingConfig) -> float:
    if rendering.turn != "walls":
        return rendering.turn
    direction = wall_direction(store, views.map_from_laser[: views.keyframes])
    return 0.0 if direction is None else -direction


def _without_left_out(views: Views, rendering: RenderingConfig) -> tuple[Views, list[str]]:
    """The scans to draw; all of them, and a sentence, if none would be left."""
    seconds = np.where(np.isnan(views.seconds), -1.0, views.seconds)
    chosen = np.ones(len(seconds), dtype=np.bool_)
    for begin, end in rendering.left_out:
        chosen &= (seconds < begin) | (seconds > end)
    if chosen.all():
        return views, []
    left = views.only(chosen)
    if not any(rays.are_kept for rays in left.rays):
        return views, [
            f"The spans that are to be left out hold all scans, of {np.nanmin(views.seconds):.0f} to "
            f"{np.nanmax(views.seconds):.0f} s; leave some in."
        ]
    return left, []


def _box(views: Views, rendering: RenderingConfig) -> tuple[Box | None, list[str]]:
    """The box to draw; None for everything, with a sentence if the box is empty."""
    if rendering.crop is None:
        return None, []
    if rendering.crop == "driven":
        margin = rendering.driven_margin
        return (views.path.min(axis=0) - margin, views.path.max(axis=0) + margin), []
    low, high = np.array(rendering.crop[:2]), np.array(rendering.crop[2:])
    seen_low, seen_high = seen_box(bounds_of(views.rays, views.map_from_laser), 0.0)
    if np.any(low >= seen_high) or np.any(high <= seen_low):
        return None, [
            f"Nothing was seen in the box {_in_words(low, high)}, to which the map is to be cropped; what "
            f"was seen lies in {_in_words(seen_low, seen_high)}."
        ]
    return (low, high), []


def _in_words(low: NDArray[np.float64], high: NDArray[np.float64]) -> str:
    return f"x {low[0]:.1f} to {high[0]:.1f} m, y {low[1]:.1f} to {high[1]:.1f} m"


def _shift(grid: TiledGrid, rendering: RenderingConfig) -> NDArray[np.float64]:
    """(2,) shift in metres that puts the origin where it is configured."""
    if rendering.origin is None:
        return np.zeros(2)
    return -grid.map_from_grid[:2] if rendering.origin == "corner" else -np.array(rendering.origin)
