"""Samples of odometry that are elsewhere."""

import numpy as np
import pytest

from racecar.pipelines.bags.check import check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.odometry import Odometry
from tests.pipelines.bag_samples import PLACE, bag_of, odometry, write_scan


def findings_and_path(path, away):
    """Of a drive of 200 samples with an offset (3,) of each."""

    def write(writer):
        writer.write_static_transform(PLACE)
        for index in range(200):
            pose = np.array([0.02 * index, 0.0, 0.0]) + away(index)
            writer.write_odometry(odometry(index, odom_from_base=pose))
            write_scan(writer, index)

    with BagReader(bag_of(path / "drive.bag", write)) as reader:
        poses = [item.odom_from_base for item in reader if isinstance(item, Odometry)]
        assert check_bag(reader).counts["odometry"] == len(poses)
        return [(each.name, each.numbers.get("times")) for each in reader.findings], np.array(poses)


@pytest.mark.parametrize("offset", [(3.0, 0.0, 0.0), (0.0, 0.0, 1.2)])
def test_single_samples_are_left_out(tmp_path, offset):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array(offset) * (index % 40 == 20))
    assert what == ("odometry_spikes", "5 times")
    np.testing.assert_allclose(np.ptp(poses, axis=0), [0.02 * 199, 0.0, 0.0], atol=1e-9)
    assert len(poses) == 195


def test_two_publishers_are_named_and_the_first_is_followed(tmp_path):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array([5.0, -3.0, 1.0]) * (index % 3 == 2))
    assert what[0] == "odometry_of_two_programs"
    assert np.ptp(poses[:, 1]) == 0.0


def test_odometry_that_begins_anew_is_no_spike(tmp_path):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array([50.0, 0.0, 0.0]) * (index > 90))
    assert what == ("odometry_jumps", "once")
    assert len(poses) == 199


def test_an_orientation_that_is_not_a_number_is_not_called_still(tmp_path):
    def write(writer):
        writer.write_static_transform(PLACE)
        for index in range(60):
            writer.write_odometry(odometry(index, odom_from_base=np.array([0.02 * index, 0.0, np.nan])))
            write_scan(writer, index)

    with BagReader(bag_of(tmp_path / "drive.bag", write)) as reader:
        items = [item for item in reader if isinstance(item, Odometry)]
        (name,) = [finding.name for finding in reader.findings]
    assert name == "odometry_without_orientation"
    assert items[-1].odom_from_base[0] == pytest.approx(0.8 * 59 * 0.025, abs=0.01)
