"""All floor plans by name.

``python -m racecar.pipelines.simulation.plans.catalogue`` draws the shipped ones anew.

The shipped ones are files in ``maps/shipped``; the others are drawn whenever they are asked for.
"""

from collections.abc import Callable
from pathlib import Path

import racecar.maps.shipped
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.simulation.plans.building import draw_building
from racecar.pipelines.simulation.plans.campus import draw_campus
from racecar.pipelines.simulation.plans.research import (
    draw_bare_corridor,
    draw_long_track,
    draw_twin_corridors,
)
from racecar.pipelines.simulation.plans.track import draw_track

SHIPPED: dict[str, Callable[[], OccupancyGrid]] = {"building": draw_building, "track": draw_track}
ON_DEMAND: dict[str, Callable[[], OccupancyGrid]] = {
    "twin_corridors": draw_twin_corridors,
    "bare_corridor": draw_bare_corridor,
    "long_track": draw_long_track,
    "campus": draw_campus,
}


def load_or_draw(path: Path) -> OccupancyGrid:
    """The map at a path, of a shipped map's name, or drawn on demand; UserError when it is none of these."""
    if path.exists() or str(path) in SHIPPED:
        return load_map(path)
    if str(path) in ON_DEMAND:
        return ON_DEMAND[str(path)]()
    raise UserError(
        f"There is no map at {path}: give a map's YAML file, a folder that holds a map.yaml, or the name of "
        f"a built-in plan ({', '.join([*SHIPPED, *ON_DEMAND])})."
    )


def draw_shipped(folder: Path) -> None:
    """Draw the shipped maps into a folder."""
    for name, draw in SHIPPED.items():
        save_map(draw(), folder / f"{name}.yaml")


if __name__ == "__main__":
    draw_shipped(Path(racecar.maps.shipped.__file__).parent / "shipped")
