"""Compile the numba kernels, so that the first real run starts at once.

``python -m racecar.pipelines.commands.warm_up``
"""

import tempfile
from pathlib import Path

from racecar.localization.config import LocalizationConfig
from racecar.localization.warm_up import warm_up as warm_up_localizer
from racecar.maps.map_files import load_map
from racecar.pipelines.runs.demo_run import run_demo
from racecar.pipelines.runs.run_context import RunContext


def warm_up() -> None:
    """Run every stage on a short drive; the compiled kernels stay on disk."""
    with tempfile.TemporaryDirectory() as folder:
        run_demo(
            load_map("ring"),
            Path(folder),
            RunContext(),
            seed=0,
            mapping_seconds=14.0,  # more than a round, so that loops are closed
            localization_seconds=1.0,
        )
    warm_up_localizer(LocalizationConfig())  # includes a search of the map, with which live nodes begin


if __name__ == "__main__":
    warm_up()
