"""Compiles the numba kernels, so that the first real run starts at once: ``python -m pipelines.warm_up``."""

import tempfile
from pathlib import Path

from maps.map_files import load_map
from pipelines.demo_run import run_demo
from pipelines.report import Report


def warm_up() -> None:
    """Go the whole way on a short drive; the compiled kernels stay on disk."""
    with tempfile.TemporaryDirectory() as folder:
        run_demo(
            load_map(Path("building")),
            Path(folder),
            Report("warm up"),
            seed=0,
            mapping_seconds=60.0,  # enough for loops to be closed
            localization_seconds=3.0,
            announce=lambda sentence: None,
            quiet=True,
        )


if __name__ == "__main__":
    warm_up()
