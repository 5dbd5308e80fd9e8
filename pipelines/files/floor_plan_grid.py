"""``floor_plan.yaml`` in the folder of a map: the floor plan under it, in the map's frame, in the format of a
map."""

from pathlib import Path

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map, save_map
from racecar.maps.whole_folders import remove_with

_YAML = "floor_plan.yaml"
FLOOR_PLAN_FILES = (_YAML, "floor_plan_image.png")
"""Names of the files."""


def floor_plan_beside(folder: Path) -> OccupancyGrid | None:
    """The plan under the map in a folder; None if there is none. Raises UserError when it cannot be read."""
    return load_map(folder / _YAML) if (folder / _YAML).is_file() else None


def save_floor_plan(plan: OccupancyGrid | None, folder: Path) -> None:
    """Write the plan, with its shades, into the folder of a new run. Without one, that of an earlier run is
    removed with it. Raises UserError when the folder cannot be written to."""
    if plan is not None:
        save_map(plan, folder / _YAML, mode="scale")
    else:
        for name in FLOOR_PLAN_FILES:
            remove_with(folder / name)
