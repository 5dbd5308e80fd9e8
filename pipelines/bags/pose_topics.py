"""A trajectory that a bag contains as a topic of poses."""

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.converters.odometry import pose_in_plane
from racecar.pipelines.bags.messages import ODOMETRY, POSE, POSE_WITH_COVARIANCE, nanoseconds
from racecar.pipelines.bags.samples import decoded
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import named_topic
from racecar.sensors.findings import Finding, counted_findings

_POSES: Mapping[str, Callable[[Any], Any]] = {
    ODOMETRY: lambda message: message.pose.pose,
    POSE_WITH_COVARIANCE: lambda message: message.pose.pose,
    POSE: lambda message: message.pose,
}
"""Extracts the pose of a message, by message type."""


def load_pose_topic(bag: Path, name: str) -> tuple[Trajectory, list[Finding]]:
    """Poses of a topic at the stamps of its messages, or their recording times if they have none; and
    findings on those dropped.

    Raises UserError when the path is not a bag, or the topic is missing, has no poses, or none is usable.
    """
    with closing(BagStore(bag)) as store:
        topic = named_topic(store.topics, list(_POSES), name, "Poses")
        counts: Counter[str] = Counter()
        poses: dict[int, Pose] = {}
        for _, recorded, message in decoded(store, [topic.name], counts):
            pose = pose_in_plane(_POSES[topic.message_type](message))
            if pose is None:
                counts["messages_without_pose"] += 1
                continue
            header = nanoseconds(message.header.stamp)
            stamp = header if header > 0 else recorded
            counts["stamps_from_recording_time"] += header <= 0
            counts["dropped_duplicates"] += stamp in poses
            poses[stamp] = pose
    findings = counted_findings(counts)
    if not poses:
        reasons = " ".join(finding.sentence for finding in findings)
        raise UserError(f"{topic.name} in {bag} holds no usable pose. {reasons}".rstrip())
    stamps = np.array(sorted(poses), dtype=np.int64)
    return Trajectory(stamps, np.array([poses[stamp] for stamp in stamps.tolist()])), findings


def pose_topics(bag: Path) -> list[str]:
    """Names of a bag's topics of poses. Raises UserError when the path is not a bag."""
    with closing(BagStore(bag)) as store:
        return [topic.name for topic in store.topics.values() if topic.message_type in _POSES]
