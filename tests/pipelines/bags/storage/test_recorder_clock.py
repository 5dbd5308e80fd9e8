"""A recorder's clock that is set back while it records."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.bags.storage.recorder_clock import set_backs
from tests.pipelines.bag_samples import START, STEP, as_sqlite, file_of, numbers_of, read, write_bag

SECOND = 1_000_000_000
DRIVE = [(index % 3 + (index % 7 == 0), START + index * STEP) for index in range(200)]
"""Channel and time of messages."""


@given(first=st.integers(10, 190), by=st.integers(2 * SECOND, 10**9 * SECOND), seed=st.integers(0, 99))
def test_the_order_of_messages_shows_when_and_by_how_much(first, by, seed):
    late = np.random.default_rng(seed).integers(0, STEP // 4, len(DRIVE)).tolist()
    moments = [
        (channel, time + late[index] - (by if index >= first else 0))
        for index, (channel, time) in enumerate(DRIVE)
    ]
    ((found, seconds),) = set_backs(moments)
    assert found == first
    assert abs(seconds - by) < 2 * STEP


def test_what_else_goes_back_in_a_file_is_no_clock():
    topic_by_topic = sorted(DRIVE)
    stray = [
        (channel, time + (900 * SECOND if index == 80 else 0)) for index, (channel, time) in enumerate(DRIVE)
    ]
    lost = [(channel, 0 if index == 80 else time) for index, (channel, time) in enumerate(DRIVE)]
    one_topic = [
        (channel, time - (300 * SECOND if channel == 1 and index > 80 else 0))
        for index, (channel, time) in enumerate(DRIVE)
    ]
    for moments in (DRIVE, topic_by_topic, stray, lost, one_topic, DRIVE[:1], []):
        assert set_backs(moments) == []


def set_back(path, kind):
    """A bag whose clock, and in two formats that of its sensors, was set back after 3 s."""
    if kind == "sqlite":
        bag = as_sqlite(write_bag(path / "drive", place=None), path / "other")
        with closing(sqlite3.connect(file_of(bag))) as connection, connection:
            connection.execute("UPDATE messages SET timestamp = timestamp - ? WHERE id > 240", [300 * SECOND])
        return bag

    def back(index):
        return START + index * STEP - (300 * SECOND if index >= 120 else 0)

    return write_bag(
        path / ("drive.bag" if kind == "ros1" else "drive"),
        place=None,
        wheels=lambda index: {"stamp": back(index)},
        scans=lambda index: {"stamp_ns": back(index)},
    )


@pytest.mark.parametrize("kind", ["ros1", "mcap", "sqlite"])
def test_a_drive_goes_on_where_all_clocks_were_set_back(tmp_path, kind):
    bag = set_back(tmp_path, kind)
    scans, samples, reader = read(bag)
    expected = START + STEP * np.arange(200)
    np.testing.assert_allclose(np.array([scan.stamp for scan in scans]) - expected, 0, atol=STEP)
    np.testing.assert_array_equal([scan.stamp for scan in scans], [sample.stamp for sample in samples])
    assert numbers_of("recorder_set_back", reader) == {
        "seconds": pytest.approx(300.0, abs=0.05),
        "at": pytest.approx(3.0, abs=0.05),
    }
    assert not {"clock_jumps", "scan_gaps"} & {finding.name for finding in reader.findings}
    (part, _, _) = read(bag, start=2.5, duration=1.0)
    assert len(part) == pytest.approx(40, abs=2)
