"""A sheet to draw floor plans on: rooms are opened, things are put into them, walls draw themselves."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

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
        about = self._about(x - radius, y - radius, x + radius, y + radius)
        self._open[about] &= (self._x[about] - x) ** 2 + (self._y[about] - y) ** 2 >= radius**2

    def solid_thicket(
        self, x0: float, y0: float, x1: float, y1: float, generator: np.random.Generator
    ) -> None:
        """Put a hedge between two corners: half of its cells, so that a beam gets in some way or other."""
        about = self._about(x0, y0, x1, y1)
        inside = self._box(x0, y0, x1, y1)[about]
        self._open[about] &= ~(inside & (generator.random(inside.shape) < 0.5))

    def open_lane(self, centers: ArrayLike, widths: ArrayLike) -> None:
        """Clear a lane along points (N, 2), closer together than a cell, with its width (N,) at each."""
        points, half = np.asarray(centers), np.broadcast_to(widths, len(np.asarray(centers))) / 2
        nearby, nearest = cKDTree(points).query(
            np.column_stack([self._x.ravel(), self._y.ravel()]), distance_upper_bound=half.max()
        )
        inside = nearby < half[np.minimum(nearest, len(points) - 1)]  # what is farther than any has inf
        self._open |= inside.reshape(self._open.shape)

    def finish(self, origin: tuple[float, float] = (0.0, 0.0)) -> OccupancyGrid:
        """The drawing as a map: free where open, occupied where solid touches it, else unknown.

        The place drawn at ``origin`` becomes the origin of the map.
        """
        cells = np.full(self._open.shape, UNKNOWN, dtype=np.int8)
        cells[binary_dilation(self._open, structure=np.ones((3, 3), dtype=np.bool_))] = OCCUPIED
        cells[self._open] = FREE
        return OccupancyGrid(cells, self._resolution, np.array([*(self._lower - np.array(origin)), 0.0]))

    def _about(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        """Rows and columns of the cells between two corners, and a cell more on each side."""
        corners = (np.array([[y0, x0], [y1, x1]]) - self._lower[::-1]) / self._resolution
        first, last = np.maximum(np.floor(corners).astype(int) + np.array([[-1], [2]]), 0)
        return slice(int(first[0]), int(last[0])), slice(int(first[1]), int(last[1]))

    def _box(self, x0: float, y0: float, x1: float, y1: float) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = (self._x > x0) & (self._x < x1) & (self._y > y0) & (self._y < y1)
        return inside
