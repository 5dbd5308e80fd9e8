"""A car on a map as it is watched, while the map grows or while the car is localized."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.studio.layers import Layers
from racecar.pipelines.studio.map_image import known_extent
from racecar.pipelines.studio.outlines import car_outline, ellipse
from racecar.pipelines.studio.page import Page

_SIGMAS = 3.0
_NEAR = 15.0
"""Metres visible from bottom to top when a car is followed: a room and what is around it."""


@dataclass(frozen=True, eq=False)
class Glimpse:
    """The car at one moment. Missing parts are not drawn, except for the path, which stays if it is None."""

    map_from_base: Pose
    scan_in_map: NDArray[np.float64]
    """(N, 2)"""
    path: Pose | None = None
    """(M, 3) driven so far."""
    particles: Pose | None = None
    """(P, 3)"""
    covariance: NDArray[np.float64] | None = None
    """(3, 3)"""
    loops: NDArray[np.float64] | None = None
    """(L, 2, 2) places (2,) connected by loop closures; None keeps those already drawn."""

    def draw(self, layers: Layers) -> None:
        """Draw on the floor."""
        layers.line("car", car_outline(self.map_from_base, layers.car_scale))
        layers.dots("scan", self.scan_in_map)
        layers.arrows("particles", np.zeros((0, 3)) if self.particles is None else self.particles)
        if self.covariance is None:
            layers.clear("ellipse")
        else:
            place, variances = self.map_from_base[:2], self.covariance[:2, :2]
            layers.line("ellipse", ellipse(place, variances, _SIGMAS))
        if self.path is not None:
            layers.line("path", self.path[:, :2])
        if self.loops is not None:
            layers.segments("loops", self.loops)


class WatchedCar:
    """The latest map and car, drawn once; earlier ones are discarded, so that memory does not grow."""

    def __init__(self, page: Page, *, follows: bool = False) -> None:
        """Adds controls of the view to the side panel; ``follows`` sets whether the view follows the car,
        until a user moves the map."""
        self._page, self._is_near = page, False
        self.forget()
        with page.folder("View"):
            page.on_press(page.gui.add_button("Show the whole map"), self.show_whole)
            self._follows: Any = page.gui.add_checkbox("Follow the car", follows)

    def forget(self) -> None:
        """Discard everything."""
        self.grid: OccupancyGrid | None = None
        self.glimpse: Glimpse | None = None
        self._drawn: tuple[OccupancyGrid | None, Glimpse | None] = None, None

    def take(self, news: OccupancyGrid | Glimpse) -> None:
        """Replace the map or the car; the first map is shown as a whole."""
        if isinstance(news, Glimpse):
            self.glimpse = news
            return
        is_first, self.grid = self.grid is None, news
        if is_first:
            self.show_whole()
        else:
            self._page.view.keep_whole(known_extent(news))

    def show_whole(self) -> None:
        """Show the whole known part of the map."""
        extent = None if self.grid is None else known_extent(self.grid)
        if extent is not None:
            self._page.view.show_whole(*extent)

    def draw(self) -> bool:
        """Draw what has changed; returns whether anything has."""
        grid, glimpse = self._drawn
        has_changed = grid is not self.grid or glimpse is not self.glimpse
        self._drawn = self.grid, self.glimpse
        if self.grid is not None and self.grid is not grid:
            self._page.layers.map(self.grid)
        if self.glimpse is not None and self.glimpse is not glimpse:
            self.glimpse.draw(self._page.layers)
            self._follow(self.glimpse)
        return has_changed

    def _follow(self, glimpse: Glimpse) -> None:
        """Keep the car in the middle; the first time, go near."""
        view = self._page.view
        if view.was_moved:
            self._follows.value = view.was_moved = False
        if not self._follows.value:
            self._is_near = False
        elif self._is_near:
            view.follow(glimpse.map_from_base[:2])
        else:
            self._is_near = True
            view.go_to(glimpse.map_from_base[:2], _NEAR)
