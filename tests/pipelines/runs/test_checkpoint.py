"""What is gone on from, and what is left aside."""

from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.errors import UserError
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.runs.checkpoint import Checkpoint

BEARINGS = np.deg2rad(np.arange(-135.0, 135.0))
RUN = {"bag": "drive.bag", "settings": {"resolution": 0.05}}


def mapper(scans: int) -> Mapper:
    """Which has driven 5 cm a scan through a room."""
    mapper = Mapper(MappingConfig())
    for k in range(scans):
        ends = np.where(np.cos(BEARINGS) > 0, 6.0 - 0.05 * k, -4.0 - 0.05 * k) / np.cos(BEARINGS)
        ranges = np.minimum(ends, 3.0 / np.abs(np.sin(BEARINGS) + 1e-9))
        mapper.add_scan(
            Scan(k * 25_000_000, BEARINGS, ranges, np.zeros_like(ranges), np.zeros(3), max_range=30.0)
        )
    return mapper


def test_there_is_nothing_to_begin_with(tmp_path: Path) -> None:
    assert Checkpoint(tmp_path / "out", RUN).resume(MappingConfig()) is None


def test_goes_on_with_the_same_run(tmp_path: Path) -> None:
    checkpoint = Checkpoint(tmp_path / "out", RUN)
    checkpoint.save(mapper(20).to_arrays(), 33)
    assert [path.name for path in tmp_path.iterdir()] == ["out.checkpoint.npz"]
    resumed = Checkpoint(tmp_path / "out", RUN).resume(MappingConfig())
    assert resumed is not None
    assert resumed.messages == 33
    assert len(resumed.mapper.finish().trajectory) == 20
    checkpoint.remove()
    assert list(tmp_path.iterdir()) == []


def test_what_the_run_keeps_besides_the_mapper_comes_back(tmp_path: Path) -> None:
    checkpoint = Checkpoint(tmp_path / "out", RUN)
    checkpoint.save(mapper(2).to_arrays(), 2, {"place": np.array([0.27, 0.0, 0.1])})
    resumed = checkpoint.resume(MappingConfig())
    assert resumed is not None
    assert list(resumed.besides) == ["place"]
    np.testing.assert_array_equal(resumed.besides["place"], [0.27, 0.0, 0.1])


def test_other_runs_and_damaged_files_are_told(tmp_path: Path) -> None:
    checkpoint = Checkpoint(tmp_path / "out", RUN)
    checkpoint.save(mapper(2).to_arrays(), 2)
    other = Checkpoint(tmp_path / "out", {**RUN, "settings": {"resolution": 0.1}})
    with pytest.raises(UserError, match="of another bag or of other settings"):
        other.resume(MappingConfig())
    checkpoint.path.write_bytes(checkpoint.path.read_bytes()[:1000])
    with pytest.raises(UserError, match="damaged"):
        checkpoint.resume(MappingConfig())
