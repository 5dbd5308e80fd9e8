"""A trajectory that a bag holds as a topic of poses."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.converters.odometry import pose_in_plane
from racecar.pipelines.bags.messages import ODOMETRY, POSE, POSE_WITH_COVARIANCE, nanoseconds
from racecar.pipelines.bags.samples import decode_or_count
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import named_topic
from racecar.sensors.findings import Finding, counted_findings

_POSES: Mapping[str, Callable[[Any], Any]] = {
    ODOMETRY: lambda message: message.pose.pose,
    POSE_WITH_COVARIANCE: lambda message: message.pose.pose,
    POSE: lambda message: message.pose,
}
"""What of a message is the pose, by message type."""


def load_pose_topic(bag: Path, name: str) -> tuple[Trajectory, list[Finding]]:
    """The poses of a topic at the stamps of its messages, and what was left out of them.

    Raises UserError when the path holds no bag, the topic is not in it or not of poses, or none is usable.
    """
    store = BagStore(bag)
    try:
        topic = named_topic(store.topics, list(_POSES), name, "Poses")
        counts: Counter[str] = Counter()
        poses: dict[int, Pose] = {}
        for stamp, pose in _stamped_poses(store, topic, counts):
            counts["dropped_duplicates"] += stamp in poses
            poses[stamp] = pose
    finally:
        store.close()
    findings = counted_findings(counts)
    if not poses:
        reasons = " ".join(finding.sentence for finding in findings)
        raise UserError(f"{topic.name} in {bag} holds no usable pose. {reasons}".rstrip())
    stamps = np.array(sorted(poses), dtype=np.int64)
    return Trajectory(stamps, np.array([poses[stamp] for stamp in stamps.tolist()])), findings


def pose_topics(bag: Path) -> list[str]:
    """The names of a bag's topics of poses. Raises UserError when the path holds no bag."""
    store = BagStore(bag)
    store.close()
    return [topic.name for topic in store.topics.values() if topic.message_type in _POSES]


def _stamped_poses(store: BagStore, topic: BagTopic, counts: Counter[str]) -> Iterator[tuple[int, Pose]]:
    """Stamp and pose of each usable message; a message without a stamp gives the time of its recording."""
    for _, recorded, data in store.messages([topic.name]):
        message = decode_or_count(topic, data, counts)
        if message is None:
            continue
        pose = pose_in_plane(_POSES[topic.message_type](message))
        if pose is None:
            counts["messages_without_pose"] += 1
            continue
        stamp = nanoseconds(message.header.stamp)
        counts["stamps_from_recording_time"] += stamp <= 0
        yield (stamp if stamp > 0 else recorded), pose
