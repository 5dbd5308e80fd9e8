"""What is serialized at once is what ROS serializes."""

import numpy as np
import pytest


@pytest.mark.parametrize("frame", ["m", "map", "odom", "a_long_name", "robot/map"])
@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_poses_and_paths_are_read_by_ros_as_they_were_meant(frame: str, count: int) -> None:
    from geometry_msgs.msg import PoseArray
    from nav_msgs.msg import Path
    from rclpy.serialization import deserialize_message

    from racecar.pipelines.live.ros.bulk_messages import path_bytes, pose_array_bytes
    from racecar.pipelines.live.ros.messages import time_message

    poses = np.random.default_rng(count).normal(size=(count, 3))
    stamp = time_message(1_700_000_000_123_456_789)
    array = deserialize_message(pose_array_bytes(stamp, frame, poses), PoseArray)
    path = deserialize_message(path_bytes(stamp, frame, poses), Path)
    assert array.header.stamp == path.header.stamp == stamp
    assert array.header.frame_id == path.header.frame_id == frame
    assert len(array.poses) == len(path.poses) == count
    for pose, one, other in zip(poses, array.poses, path.poses, strict=True):
        assert one == other.pose
        assert other.header == path.header
        assert [one.position.x, one.position.y] == pose[:2].tolist()
        assert 2 * np.arctan2(one.orientation.z, one.orientation.w) == pytest.approx(pose[2])
