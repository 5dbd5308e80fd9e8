"""Odometry messages, also where only their twist tells anything."""

from types import SimpleNamespace as Some

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.bags.converters.odometry import PoseSource, planar_pose, pose_source
from racecar.pipelines.bags.messages import ODOMETRY
from tests.pipelines.bag_samples import STEP, bag_of, numbers_of, odometry, read, write_bag, write_scan


def test_poses_without_a_rotation_are_dropped_and_counted(tmp_path):
    def write(writer):
        plain = writer.write_message
        writer.write_message = lambda topic, kind, message, stamp: plain(
            topic, kind, spoilt(kind, message), stamp
        )
        for index in range(60):
            writer.write_odometry(odometry(index))
            write_scan(writer, index)

    sent = []

    def spoilt(kind, message):
        if kind == ODOMETRY:
            sent.append(message)
            if len(sent) in (30, 40):
                message.pose.pose.orientation.w = message.pose.pose.orientation.z = 0.0
            if len(sent) == 50:
                message.pose.pose.position.x = np.nan
            if len(sent) == 55:
                message.pose.pose.position.y = -1e300
            if len(sent) == 58:
                message.twist.twist.linear.x = 1e200
        return message

    _, samples, reader = read(bag_of(tmp_path / "drive.bag", write))
    assert (len(samples), reader.counts["invalid_odometry"]) == (56, 4)
    assert max(abs(sample.twist).max() for sample in samples) < 1.0


@pytest.mark.parametrize("garbage", [{"x": 1e256}, {"w": np.nan}, {"w": 0.0}])
def test_poses_that_are_garbage_at_first_are_used_from_where_they_are_right(garbage):
    def message(x=0.0, w=1.0):
        numbers = Some(position=Some(x=x, y=0.0), orientation=Some(x=0.0, y=0.0, z=0.0, w=w))
        speeds = Some(linear=Some(x=1.0, y=0.0), angular=Some(z=0.0))
        return Some(pose=Some(pose=numbers), twist=Some(twist=speeds))

    right = [message(x=0.02 * index) for index in range(50)]
    assert pose_source([message(**garbage)] * 50 + right) == PoseSource.POSE
    assert pose_source([message(**garbage)] * 50 + right[:1] * 50) == PoseSource.TWIST
    assert pose_source([message(**garbage)] * 50) == PoseSource.TWIST


@pytest.mark.parametrize("frozen", [np.zeros(3), np.array([3.0, 1.0, 0.4])])
def test_where_the_pose_stands_still_the_speeds_are_integrated(tmp_path, frozen):
    turning, speed, count = 0.5, 1.0, 400

    def standing(index):
        moves = np.array([speed, 0.0, turning]) if index > 20 else np.zeros(3)
        return {"odom_from_base": frozen, "twist": moves}

    _, samples, reader = read(write_bag(tmp_path / "drive.bag", count, place=None, wheels=standing))
    angle = turning * (count - 21) * STEP * 1e-9
    circle = np.array([np.sin(angle), 1 - np.cos(angle)]) * speed / turning
    np.testing.assert_allclose(samples[-1].odom_from_base[:2], circle, atol=1e-6)
    assert numbers_of("odometry_by_speeds", reader)


def test_poses_that_start_to_move_late_are_kept(tmp_path):
    def late(index):
        return {"odom_from_base": np.array([0.02 * max(index - 200, 0), 0.0, 0.0]), "twist": np.zeros(3)}

    _, samples, reader = read(write_bag(tmp_path / "drive.bag", 300, place=None, wheels=late))
    assert samples[-1].odom_from_base[0] == pytest.approx(0.02 * 99)
    assert [finding.name for finding in reader.findings] == ["place_unknown"]


@given(yaw=st.floats(-3.1, 3.1), x=st.floats(-1e3, 1e3), scale=st.floats(0.5, 2))
def test_a_pose_survives_the_message(yaw, x, scale):
    rotation = Some(x=0.0, y=0.0, z=scale * np.sin(yaw / 2), w=scale * np.cos(yaw / 2))
    sent = Some(pose=Some(pose=Some(position=Some(x=x, y=1.0), orientation=rotation)))
    np.testing.assert_allclose(planar_pose(sent), [x, 1.0, yaw], atol=1e-9)
