"""Keepout and speed-limit areas in the format of nav2's costmap filters.

Each filter has a mask, stored as an image and a YAML file like a map, and a parameter file for the two nodes
that serve it: nav2_map_server's ``map_server`` and ``costmap_filter_info_server``. The latter's ``type`` is 0
for keepout and 2 for speed in metres per second; a cell means ``base + multiplier * value``.

The parameters name no mask, since a relative path would hold in one working directory alone, and an absolute
one until the run is copied to the robot: ``costmap_filter.launch.xml`` names that in the run's folder.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from racecar.maps.grid.edits import Edit, keepout_mask, speed_mask
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.map_files import save_map
from racecar.maps.whole_files import write_atomically
from racecar.maps.whole_folders import remove_with

FILTERS = {"keepout": 0, "speed": 2}
"""nav2's numbers for filter types, by definition of CostmapFilterInfo."""


def filter_files(name: str) -> tuple[str, ...]:
    """Names of a filter's files."""
    return f"{name}_mask.yaml", f"{name}_mask.pgm", f"{name}_filter.yaml"


def save_filter_masks(grid: TiledGrid, edits: Sequence[Edit], folder: Path) -> None:
    """Write the masks for the edits, with the cells of a grid, into the folder of a new run. Other masks,
    from an earlier run, are removed with it. Raises UserError when the folder cannot be written to."""
    wanted = {edit.kind for edit in edits}
    if "keepout" in wanted:
        _save(keepout_mask(grid, edits), "keepout", 1.0, folder)
    if "speed" in wanted:
        mask, metres_per_second = speed_mask(grid, edits)
        _save(mask, "speed", metres_per_second, folder)
    for name in FILTERS.keys() - wanted:
        for file in filter_files(name):
            remove_with(folder / file)


def _save(mask: TiledGrid, name: str, multiplier: float, folder: Path) -> None:
    mask_yaml, _, parameters_yaml = filter_files(name)
    save_map(mask, folder / mask_yaml, mode="raw")  # each value unchanged
    topic = f"/{name}_filter_mask"
    parameters: dict[str, dict[str, Any]] = {
        f"{name}_filter_mask_server": {"topic_name": topic, "frame_id": "map"},
        f"{name}_costmap_filter_info_server": {
            "type": FILTERS[name],
            "filter_info_topic": f"/{name}_costmap_filter_info",
            "mask_topic": topic,
            "base": 0.0,
            "multiplier": multiplier,
        },
    }
    nodes = {node: {"ros__parameters": values} for node, values in parameters.items()}
    with write_atomically(folder / parameters_yaml) as partial:
        partial.write_text(yaml.safe_dump(nodes, sort_keys=False), encoding="utf-8")
