"""How publishers and subscriptions deliver: reliably and kept for whoever comes late, or as sensors send."""

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""The latest message is delivered to whoever subscribes later, too."""


def sensor_qos(depth: int) -> QoSProfile:
    """As sensors publish; deep, because what is waiting when Python is busy must not be lost."""
    return QoSProfile(
        depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
    )


def is_heard(publisher: Any) -> bool:
    """Whether anybody listens to a topic."""
    return bool(publisher.get_subscription_count())
