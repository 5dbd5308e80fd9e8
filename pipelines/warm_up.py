"""Compiles the numba kernels, so that the first real run starts at once: ``python -m pipelines.warm_up``."""

import tempfile
from pathlib import Path

from localization.config import LocalizationConfig
from maps.occupancy_grid import OccupancyGrid
from pipelines.demo_run import run_demo
from pipelines.floor_canvas import FloorCanvas
from pipelines.live.warm_up_localizer import warm_up_localizer
from pipelines.report import Report


def warm_up() -> None:
    """Go the whole way on a short drive; the compiled kernels stay on disk."""
    with tempfile.TemporaryDirectory() as folder:
        run_demo(
            draw_ring(),
            Path(folder),
            Report("warm up"),
            seed=0,
            mapping_seconds=14.0,  # more than a round, so that loops are closed
            localization_seconds=1.0,
            announce=lambda sentence: None,
            quiet=True,
        )
    warm_up_localizer(LocalizationConfig())  # a search of the map, too, as live nodes begin with


def draw_ring() -> OccupancyGrid:
    """A room of 8 × 6 m to drive round in, with a block in its middle and corners that differ."""
    plan = FloorCanvas((-1.0, -1.0), (9.0, 7.0))
    plan.open_box(0.0, 0.0, 8.0, 6.0)
    plan.solid_box(2.4, 2.2, 5.6, 3.8)
    plan.solid_disc(0.3, 5.7, 0.4)
    plan.solid_box(7.2, 0.0, 8.0, 0.8)
    plan.solid_table(4.0, 6.0, 1.5, 0.5, 0.3)
    return plan.finish(origin=(4.0, 1.0))


if __name__ == "__main__":
    warm_up()
