"""QoS profiles: reliable and latched, or as for sensors."""

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""The latest message is delivered to late subscribers, too."""


def sensor_qos(depth: int) -> QoSProfile:
    """For sensor topics; deep, because messages that wait while Python is busy must not be lost."""
    return QoSProfile(
        depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
    )


def is_heard(publisher: Any) -> bool:
    """Whether a topic has subscribers."""
    return bool(publisher.get_subscription_count())
