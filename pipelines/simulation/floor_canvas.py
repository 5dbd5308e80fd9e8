"""A sheet to draw floor plans on: rooms are opened, things are put into them, walls draw themselves."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


class FloorCanvas:
    """Draws in metres of the map frame.

    Only what is open (free) and what is solid is drawn. ``finish`` makes each solid cell that touches the
    open an occupied one, so that walls and furniture come out one cell thick with nothing known behind,
    as a LiDAR sees them.
    """

    def __init__(
        self, lower: tuple[float, float], upper: tuple[float, float], resolution: float = 0.05
    ) -> None:
        """A sheet from the lower left to the upper right corner, all solid."""
        self._lower, self._resolution = np.array(lower), resolution
        columns, rows = np.round((np.array(upper) - self._lower) / resolution).astype(int)
        self._open = np.zeros((rows, columns), dtype=np.bool_)
        y, x = (np.indices((rows, columns)) + 0.5) * resolution
        self._x, self._y = x + lower[0], y + lower[1]

    def open_box(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Clear the floor between two corners."""
        self._open |= self._box(x0, y0, x1, y1)

    def solid_box(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Put a thing with straight sides between two corners."""
        self._open &= ~self._box(x0, y0, x1, y1)

    def solid_table(self, x: float, y: float, length: float, width: float, yaw: float) -> None:
        """Put a turned box, centred at (x, y), yaw in radians."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        along = cos * (self._x - x) + sin * (self._y - y)
        across = -sin * (self._x - x) + cos * (self._y - y)
        self._open &= ~((np.abs(along) < length / 2) & (np.abs(across) < width / 2))

    def solid_disc(self, x: float, y: float, radius: float) -> None:
        """Put a round thing."""
        self._open &= (self._x - x) ** 2 + (self._y - y) ** 2 >= radius**2

    def finish(self, origin: tuple[float, float] = (0.0, 0.0)) -> OccupancyGrid:
        """The drawing as a map: free where open, occupied where solid touches it, else unknown.

        The place drawn at ``origin`` becomes the origin of the map.
        """
        cells = np.full(self._open.shape, UNKNOWN, dtype=np.int8)
        cells[binary_dilation(self._open, structure=np.ones((3, 3), dtype=np.bool_))] = OCCUPIED
        cells[self._open] = FREE
        return OccupancyGrid(cells, self._resolution, np.array([*(self._lower - np.array(origin)), 0.0]))

    def _box(self, x0: float, y0: float, x1: float, y1: float) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = (self._x > x0) & (self._x < x1) & (self._y > y0) & (self._y < y1)
        return inside


def draw_ring() -> OccupancyGrid:
    """A room of 8 × 6 m to drive round in, with a block in its middle and corners that differ."""
    plan = FloorCanvas((-1.0, -1.0), (9.0, 7.0))
    plan.open_box(0.0, 0.0, 8.0, 6.0)
    plan.solid_box(2.4, 2.2, 5.6, 3.8)
    plan.solid_disc(0.3, 5.7, 0.4)
    plan.solid_box(7.2, 0.0, 8.0, 0.8)
    plan.solid_table(4.0, 6.0, 1.5, 0.5, 0.3)
    return plan.finish(origin=(4.0, 1.0))
