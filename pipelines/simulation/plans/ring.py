"""A room to drive round in, the smallest plan in which a loop closes."""

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.plans.canvas import FloorCanvas


def draw_ring() -> OccupancyGrid:
    """A room of 8 × 6 m to drive round in, with a block in its middle and corners that differ."""
    plan = FloorCanvas((-1.0, -1.0), (9.0, 7.0))
    plan.open_box(0.0, 0.0, 8.0, 6.0)
    plan.solid_box(2.4, 2.2, 5.6, 3.8)
    plan.solid_disc(0.3, 5.7, 0.4)
    plan.solid_box(7.2, 0.0, 8.0, 0.8)
    plan.solid_table(4.0, 6.0, 1.5, 0.5, 0.3)
    return plan.finish(origin=(4.0, 1.0))
