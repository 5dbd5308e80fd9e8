"""What the package offers at its top, to those who write ``import racecar``."""

from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

import racecar
from racecar.pipelines.bags.writer import BagWriter


def test_the_version_is_that_of_the_package() -> None:
    assert racecar.__version__ == version("racecar-slam")
    with pytest.raises(AttributeError):
        racecar.no_such_name  # type: ignore[attr-defined]  # noqa: B018


def test_paths_may_be_plain_strings(tmp_path: Path) -> None:
    with BagWriter(str(tmp_path / "drive.bag")) as writer:
        for k in range(3):
            ranges = np.full(180, 2.0, dtype=np.float32)
            writer.write_scan(k * 25_000_000, ranges, -1.5, 0.017, 0.0, 0.025, 0.1, 10.0)
    with racecar.BagReader(str(tmp_path / "drive.bag")) as reader:
        assert sum(isinstance(message, racecar.Scan) for message in reader) == 3
    grid = racecar.load_map("track")
    racecar.save_map(grid, str(tmp_path / "map.yaml"))
    assert np.array_equal(racecar.load_map(str(tmp_path)).cells, grid.cells)
