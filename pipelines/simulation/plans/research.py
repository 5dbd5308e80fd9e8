"""Places that are hard to map, drawn on demand: look-alike corridors, bare ones, long ones."""

from math import radians

import numpy as np

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.plans.canvas import FloorCanvas


def draw_twin_corridors(length: float = 40.0, apart: float = 6.0, width: float = 2.0) -> OccupancyGrid:
    """Two parallel corridors with the same door niches, joined at both ends.

    Along them the two look the same. The map's origin is in the southern one,
    5 m from its western end; ``apart`` is from middle to middle.
    """
    plan = FloorCanvas((-2.0, -2.5), (length + 2.0, apart + 2.5))
    for y in (0.0, apart):
        plan.open_box(-width / 2, y - width / 2, length + width / 2, y + width / 2)
        for x in np.arange(3.0, length - 2.0, 4.0):
            plan.open_box(x, y - width / 2 - 0.25, x + 1.0, y)
            plan.open_box(x + 1.7, y, x + 2.7, y + width / 2 + 0.25)
    for x in (0.0, length):
        plan.open_box(x - width / 2, -width / 2, x + width / 2, apart + width / 2)
    plan.solid_disc(length - 0.7, apart / 2, 0.25)  # one end is known by its pillar
    return plan.finish(origin=(5.0, 0.0))


def draw_bare_corridor(length: float = 60.0, width: float = 2.2) -> OccupancyGrid:
    """A corridor with nothing to see along it between two rooms; the origin is in the western one."""
    plan = FloorCanvas((-5.0, -5.0), (length + 13.0, 5.0))
    plan.open_box(-4.0, -4.0, 4.0, 4.0)
    plan.open_box(3.5, -width / 2, length + 4.5, width / 2)
    plan.open_box(length + 4.0, -4.0, length + 12.0, 3.0)
    plan.solid_box(-4.0, 2.6, -1.5, 4.0)
    plan.solid_disc(1.6, -2.6, 0.4)
    plan.solid_table(-2.4, -2.6, 1.6, 0.8, radians(25))
    plan.solid_disc(length + 9.0, -2.2, 0.5)
    plan.solid_box(length + 10.8, 0.0, length + 12.0, 1.4)
    plan.solid_table(length + 6.0, 2.0, 1.4, 0.7, radians(-20))
    return plan.finish()


def draw_long_track(size: float = 125.0, pitch: float = 25.0, width: float = 2.4) -> OccupancyGrid:
    """A kilometre of corridor that winds through a square and closes only at its end, all blocks the same.

    ``size / pitch`` must be odd so that the winding comes back. The origin is on the southern side,
    10 m from its western corner; every ``pitch`` metres stands the same niche.
    """
    columns = round(size / pitch) + 1
    if columns % 2:
        raise ValueError("size / pitch must be odd")
    plan = FloorCanvas((-4.0, -4.0), (size + 4.0, size + 4.0))
    half, niche = width / 2, 0.4
    plan.open_box(-half, -half, size + half, half)
    for column in range(columns):
        x = column * pitch
        foot = 0.0 if column in (0, columns - 1) else pitch
        plan.open_box(x - half, foot - half, x + half, size + half)
        joint = size if column % 2 == 0 else pitch
        if column < columns - 1:
            plan.open_box(x - half, joint - half, x + pitch + half, joint + half)
        for y in np.arange(pitch / 2, size, pitch / 2):
            if y > foot + width:
                plan.open_box(x, y - 0.5, x + half + niche, y + 0.5)
                plan.open_box(x - half - niche, y + 2.0, x, y + 3.0)
    for x in np.arange(pitch / 2, size, pitch / 2):
        plan.open_box(x - 0.5, 0.0, x + 0.5, half + niche)
        plan.open_box(x + 2.0, -half - niche, x + 3.0, 0.0)
    return plan.finish(origin=(10.0, 0.0))
