"""The shipped race track: a lap of about 60 m between walls, with bends of different radii."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.plans.canvas import FloorCanvas

CORNERS = (
    (0.0, 0.0), (6.0, 0.0), (11.5, -0.2), (15.6, 1.2), (17.2, 4.6), (15.4, 7.8), (11.6, 8.2), (9.3, 5.8),
    (6.6, 4.3), (4.0, 6.0), (4.4, 9.4), (2.4, 12.0), (-1.4, 11.6), (-3.8, 8.2), (-4.6, 3.8), (-3.2, 0.8),
)  # fmt: skip
"""Points the lap runs through, metres, counter-clockwise."""


def lap_line(samples: int = 6000) -> NDArray[np.float64]:
    """(N, 2) the middle of the lane, once round from the map's origin."""
    corners = np.array([*CORNERS, CORNERS[0]])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    spline = make_interp_spline(np.concatenate([[0.0], np.cumsum(lengths)]), corners, bc_type="periodic")
    line: NDArray[np.float64] = spline(np.linspace(0.0, lengths.sum(), samples, endpoint=False))
    return line


def draw_track() -> OccupancyGrid:
    """The track; the map's origin is on the start line, the lap leaves it along x."""
    plan = FloorCanvas((-8.0, -3.0), (20.0, 15.0))
    line = lap_line()
    turns = np.linspace(0.0, 2.0 * np.pi, len(line), endpoint=False)
    plan.open_lane(line, 2.25 + 0.2 * np.sin(3.0 * turns) + 0.1 * np.sin(7.0 * turns + 1.0))
    plan.open_box(7.0, -1.9, 8.6, -0.9)  # the pit
    plan.solid_box(2.6, 0.75, 3.4, 1.6)  # ends of barriers that stand in, tyres, a marshal's post
    plan.solid_disc(13.9, -0.75, 0.3)
    plan.solid_disc(-4.9, 6.6, 0.35)
    plan.solid_table(0.4, 12.6, 1.2, 0.5, 0.3)
    plan.solid_box(12.2, 8.8, 13.0, 9.6)
    return plan.finish()
