"""A map that grows or that a car drives on, as whoever watches it sees it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.map_image import known_extent, paint
from racecar.pipelines.studio.outlines import car_outline
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import CAR, LOOP, PARTICLE, PATH, SCAN

_PARTICLE_LENGTH = 0.15
"""Metres of a particle's arrow, by judgement."""


@dataclass(frozen=True, eq=False)
class Glimpse:
    """The car at a moment."""

    map_from_base: Pose
    scan_in_map: NDArray[np.float64]
    """(N, 2)"""
    path: Pose
    """(M, 3) driven so far."""
    particles: Pose | None = None
    """(P, 3); None where there are none."""
    loops: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(L, 2, 2) places (2,) between which loops were closed."""


class WatchedMap:
    """The latest of everything, drawn once; what was before is forgotten, so that memory does not grow."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.forget()

    def forget(self) -> None:
        """Nothing is known any more."""
        self.grid: OccupancyGrid | None = None
        self.glimpse: Glimpse | None = None
        self.draw_anew()

    def take_map(self, grid: OccupancyGrid) -> None:
        """The map from now on, the first of which is shown as a whole."""
        is_first, self.grid = self.grid is None, grid
        if is_first:
            self.show_whole()
        else:
            self._page.view.keep_whole(known_extent(grid))

    def show_whole(self) -> None:
        """Show all that is known of the map."""
        extent = None if self.grid is None else known_extent(self.grid)
        if extent is not None:
            self._page.view.show_whole(*extent)

    def entries(self) -> list[Entry]:
        """Of the legend."""
        entries = [Entry("car", [CAR]), Entry("path", [PATH]), Entry("scan", [SCAN])]
        if self.glimpse is not None and self.glimpse.particles is not None:
            entries.append(Entry("particle, with its heading", [PARTICLE]))
        return entries

    def draw_anew(self) -> None:
        """Whatever is known is news."""
        self._drawn_grid: OccupancyGrid | None = None
        self._drawn: Glimpse | None = None

    def draw(self) -> Glimpse | None:
        """Draw what is news; where the car is, if that is."""
        layers, glimpse = self._page.layers, self.glimpse
        if self.grid is not None and self.grid is not self._drawn_grid:
            self._drawn_grid = self.grid
            layers.image("map", paint(self.grid, self._page.ground))
        if glimpse is None or glimpse is self._drawn:
            return None
        self._drawn = glimpse
        layers.line("path", glimpse.path[:, :2], PATH, 3.0)
        layers.segments("loops", glimpse.loops, LOOP, 2.0)
        layers.dots("scan", glimpse.scan_in_map, SCAN, 3.0)
        layers.line("car", car_outline(glimpse.map_from_base), CAR, 4.0)
        if glimpse.particles is not None:
            layers.arrows("particles", glimpse.particles, PARTICLE, _PARTICLE_LENGTH, 1.5)
        return glimpse
