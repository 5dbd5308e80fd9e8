"""The room in which one watches what a node sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.pictures.map_picture import known_cells
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.map_image import paint
from racecar.pipelines.studio.outlines import car_outline
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import CAR, PARTICLE, PATH, SCAN

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
    particles: Pose | None
    """(P, 3); None where there are none."""


class WatchRoom:
    """Shows the latest of everything; what was before is forgotten, so that memory does not grow."""

    would_be_lost = ""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._grid: OccupancyGrid | None = None
        self._glimpse: Glimpse | None = None
        self._is_news = False
        with page.folder("View"):
            page.on_press(page.gui.add_button("Show the whole map"), self._show_whole)
            self._follows = page.gui.add_checkbox("Follow the car", False)

    def take_map(self, grid: OccupancyGrid) -> None:
        """The map from now on."""
        is_first, self._grid = self._grid is None, grid
        self._page.layers.image("map", paint(grid, self._page.ground))
        if is_first:
            self._show_whole()

    def take(self, glimpse: Glimpse) -> None:
        """Where the car is now."""
        self._glimpse, self._is_news = glimpse, True

    def draw_all(self) -> None:
        """Draw everything anew."""
        if self._grid is not None:
            self._page.layers.image("map", paint(self._grid, self._page.ground))
        self._page.legend.show(
            [Entry("car", [CAR]), Entry("path", [PATH]), Entry("scan", [SCAN]), Entry("particle", [PARTICLE])]
        )

    def step(self, seconds: float) -> None:
        """The node lets time pass."""

    def draw(self) -> None:
        """Draw the latest, once."""
        glimpse = self._glimpse
        if glimpse is None or not self._is_news:
            return
        self._is_news = False
        layers = self._page.layers
        layers.line("car", car_outline(glimpse.map_from_base), CAR, 4.0)
        layers.dots("scan", glimpse.scan_in_map, SCAN, 3.0)
        layers.line("path", glimpse.path[:, :2], PATH, 3.0)
        if glimpse.particles is not None:
            layers.arrows("particles", glimpse.particles, PARTICLE, _PARTICLE_LENGTH, 1.5)
        if self._follows.value:
            self._page.view.follow(glimpse.map_from_base[:2])

    def click(self, place: NDArray[np.float64]) -> None:
        """A click means nothing here."""

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """A drag moves the map."""
        return False

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """A drag moves the map."""

    def close(self) -> None:
        """There is nothing to end."""

    def _show_whole(self) -> None:
        known = None if self._grid is None else known_cells(self._grid)
        if self._grid is not None and known is not None and len(known):
            corners = self._grid.center_of(known[[*known.argmin(axis=0), *known.argmax(axis=0)]])
            self._page.view.show_whole(corners.min(axis=0), corners.max(axis=0))
