"""Feeding scans and odometry to what takes them."""

import numpy as np
import pytest

from racecar.pipelines.bags.replay import feed, replay
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate
from tests.pipelines.bag_samples import odometry


class Diary:
    """Writes down what it takes."""

    def __init__(self):
        self.entries = []

    def add_odometry(self, odometry):
        self.entries.append(("odometry", odometry.stamp))

    def add_yaw_rate(self, yaw_rate):
        self.entries.append(("yaw rate", yaw_rate.stamp))

    def add_scan(self, scan):
        self.entries.append(("scan", scan.stamp))
        return len(self.entries)


def scan(stamp):
    return Scan(stamp, np.zeros(1), np.ones(1), np.zeros(1), np.zeros(3), 10.0)


def test_a_message_goes_where_it_belongs():
    diary, sample = Diary(), odometry(3)
    assert feed(sample, diary) is None
    assert feed(YawRate(5, 0.1), diary) is None
    assert feed(scan(7), diary) == 3
    assert diary.entries == [("odometry", sample.stamp), ("yaw rate", 5), ("scan", 7)]


def test_a_replay_yields_each_scan_with_its_answer_before_it_reads_on():
    diary, sample, ticks = Diary(), odometry(0), iter([1.0, 1.5, 7.0, 9.0])
    steps = replay([sample, scan(5), sample, scan(9)], diary, clock=lambda: next(ticks))
    first = next(steps)
    assert (first.scan.stamp, first.answer, first.seconds) == (5, 2, 0.5)
    assert len(diary.entries) == 2
    last = next(steps)
    assert (last.scan.stamp, last.answer, last.seconds) == (9, 4, 2.0)
    with pytest.raises(StopIteration):
        next(steps)
