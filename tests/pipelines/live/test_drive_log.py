"""A drive is logged as it goes, and read as far as the file is whole."""

import os
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.saving.drive_log import AnotherDrive, DriveLog, Entry
from racecar.sensors.cloud import Cloud
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

RNG = np.random.default_rng(0)
BEARINGS = np.linspace(-2.0, 2.0, 20)
PLACE = LaserPlace("base_link", "laser", np.diag([1.0, -1.0, -1.0, 1.0]))
CLOUD = Cloud(RNG.random((7, 3), np.float32), RNG.random(7, np.float32))


def scan(stamp: int, ranges: np.ndarray, bearings: np.ndarray = BEARINGS, **more: object) -> Scan:
    times = np.linspace(0.0, 0.1, len(bearings))
    return Scan(stamp, bearings, ranges, times, np.array([0.3, 0.1, 0.2]), 30.0, **more)  # type: ignore[arg-type]


WITH_MISSES = np.where(np.arange(20) % 3, RNG.random(20).astype(np.float32), [np.nan, np.inf] * 10)
ENTRIES: list[Entry] = [
    PLACE,
    Odometry(5, np.array([1.0, 2.0, 0.1]), np.array([0.5, 0.0, 0.2])),
    YawRate(6, 0.25),
    scan(7, WITH_MISSES),
    scan(8, RNG.random(20)),
    AnotherDrive(),
    scan(9, WITH_MISSES, BEARINGS + 1e-9),
    scan(10, WITH_MISSES, laser=1, cloud=CLOUD),
    scan(11, WITH_MISSES[:0], BEARINGS[:0], cloud=Cloud(CLOUD.points[:0], CLOUD.time_offsets[:0])),
]


def fields(entry: object) -> object:
    if isinstance(entry, np.ndarray):
        return entry.dtype, entry.shape, entry.tobytes()
    return [type(entry), *map(fields, vars(entry).values())] if hasattr(entry, "__dict__") else entry


def are_same(entries: Sequence[Entry], others: Sequence[Entry]) -> bool:
    return [fields(each) for each in entries] == [fields(each) for each in others]


def logged(folder: Path, entries: Sequence[Entry] = ENTRIES) -> DriveLog:
    log = DriveLog(folder / "out")
    for entry in entries:
        log.add(entry)
    return log


def test_everything_comes_back_to_the_bit_beside_the_output_folder(tmp_path: Path) -> None:
    log = logged(tmp_path)
    assert log.path == tmp_path / "out.drive.log"
    assert are_same(list(DriveLog(tmp_path / "out").entries()), ENTRIES)
    log.remove()
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return logged(tmp_path_factory.mktemp("log")).path.read_bytes()


@given(st.data())
def test_wherever_it_is_cut_or_damaged_what_comes_before_is_read_and_what_follows_is_written_there(
    contents: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    log = DriveLog(tmp_path_factory.mktemp("log") / "out")
    at = data.draw(st.integers(0, len(contents) - 1))
    flipped = bytes([contents[at] ^ data.draw(st.integers(1, 255))])
    log.path.write_bytes(contents[:at] + (flipped + contents[at + 1 :] if data.draw(st.booleans()) else b""))
    read = list(log.entries())
    assert len(read) < len(ENTRIES)
    assert are_same(read, ENTRIES[: len(read)])
    log.add(ENTRIES[3])
    assert are_same(list(log.entries()), [*read, ENTRIES[3]])


def test_what_a_scan_takes_does_not_grow(tmp_path: Path) -> None:
    log, sizes = DriveLog(tmp_path / "out"), []
    for stamp in range(4):
        log.add(scan(stamp, WITH_MISSES))
        log.add(PLACE)
        sizes.append(log.path.stat().st_size)
    assert len(set(np.diff(sizes[:]))) == 1
    assert np.diff(sizes)[0] < 8 * len(BEARINGS)


def test_what_cannot_be_written_leaves_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = logged(tmp_path)
    file = log._file

    class Full:
        def __getattr__(self, name: str) -> object:
            return getattr(file, name)

        def write(self, record: bytes) -> int:
            assert file is not None
            return file.write(record[:5])

    monkeypatch.setattr(log, "_file", Full())
    with pytest.raises(OSError, match="cannot grow"):
        log.add(YawRate(12, 0.5))
    assert are_same(list(DriveLog(tmp_path / "out").entries()), ENTRIES)
    monkeypatch.setattr(log, "_file", file)
    log.add(YawRate(13, 0.5))
    assert are_same(list(log.entries()), [*ENTRIES, YawRate(13, 0.5)])


def test_a_drive_that_was_broken_off_lately_is_gone_on_with(tmp_path: Path) -> None:
    said: list[str] = []
    log = DriveLog(tmp_path / "out")
    log.go_on(said.append)
    assert log.broken_off is None and not said
    logged(tmp_path)
    log.go_on(said.append)
    assert log.broken_off is not None and log.broken_off < 60.0
    assert "the drive goes on from" in said[-1]
    assert are_same(list(log.entries()), ENTRIES)


@pytest.mark.parametrize("contents", [b"", b"racecar drive log 0\nSxyz"])
def test_what_is_no_log_is_told_and_replaced(contents: bytes, tmp_path: Path) -> None:
    said: list[str] = []
    log = DriveLog(tmp_path / "out")
    log.path.write_bytes(contents)
    log.go_on(said.append)
    assert log.broken_off is None
    assert "from scratch" in said[-1]
    log.add(ENTRIES[1])
    assert are_same(list(log.entries()), ENTRIES[1:2])


def test_one_of_an_earlier_drive_is_told_and_replaced(tmp_path: Path) -> None:
    said: list[str] = []
    logged(tmp_path)
    log = DriveLog(tmp_path / "out")
    os.utime(log.path, (time.time() - 4000.0,) * 2)
    log.go_on(said.append)
    assert log.broken_off is None
    assert "is of an earlier drive and is not used" in said[-1]
    log.add(ENTRIES[1])
    assert are_same(list(log.entries()), ENTRIES[1:2])
