"""The bond by which nav2's lifecycle manager notices that a node has died; see bondcpp and `nav2_util`."""

import time
from typing import Any
from uuid import uuid4

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import BOND, ros2_types
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.node_share import NodeShare

_PERIOD, _TIMEOUT = 0.1, 4.0
"""Seconds between heartbeats, and of silence after which the other end is dead: those of nav2's nodes."""
_CONNECT_WITHIN = 10.0
"""Seconds without a manager after which the bond is dead: bondcpp's default."""
_LAST_WORD = Duration(nanoseconds=100_000_000)
"""For which a broken bond waits for the manager: as bondcpp does."""


class Bond:
    """A node's end, named after it. Like those of nav2's nodes it does not mind a manager that falls silent,
    and it is dead once the manager breaks it."""

    def __init__(self, node: Any) -> None:
        """Sends heartbeats from now on. Raises UserError if this ROS cannot send them."""
        kind = message_class(BOND)
        if kind is None:
            raise UserError(
                "This ROS has no package bond, so no lifecycle manager can watch the node; install it (with "
                "apt: ros-<distribution>-bond)."
            )
        self._node, self._instance = NodeShare(node), str(uuid4())
        self._is_dead, self._is_formed, self._began = False, False, time.monotonic()
        self._publisher = self._node.create_publisher(kind, "bond", 5)
        self._node.create_subscription(kind, "bond", self._hear, 100, raw=True)
        self._node.create_timer(_PERIOD, self._beat, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def destroy(self) -> None:
        """Break the bond, of which the manager hears."""
        if not self._is_dead:
            self._publish(is_active=False)
            self._publisher.wait_for_all_acked(_LAST_WORD)
        self._node.destroy()

    def _beat(self) -> None:
        if not self._is_formed and time.monotonic() - self._began > _CONNECT_WITHIN:
            self._is_dead = True
        if not self._is_dead:
            self._publish(is_active=True)

    def _hear(self, serialized: bytes) -> None:
        status: Any = ros2_types().deserialize_cdr(serialized, BOND)
        if status.id != self._node.get_name() or status.instance_id == self._instance:
            return
        self._is_formed = True
        if not status.active:
            self._is_dead = True
            self._publish(is_active=False)

    def _publish(self, *, is_active: bool) -> None:
        types, now = ros2_types().types, self._node.get_clock().now().to_msg()
        stamp = types["builtin_interfaces/msg/Time"](sec=now.sec, nanosec=now.nanosec)
        status = types[BOND](
            header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
            id=self._node.get_name(),
            instance_id=self._instance,
            active=is_active,
            heartbeat_timeout=_TIMEOUT,
            heartbeat_period=_PERIOD,
        )
        self._publisher.publish(bytes(ros2_types().serialize_cdr(status, BOND)))
