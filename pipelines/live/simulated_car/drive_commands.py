"""Speed and steering commands: ``cmd_vel`` as for most robots, ``drive`` as for race cars."""

import math
from collections.abc import Callable
from typing import Any

from racecar.pipelines.bags.messages import ACKERMANN, ros2_types
from racecar.pipelines.live.intake.typed_topic import TypedTopic
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.simulation.car import steering_for
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation

_VELOCITIES = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
_DEPTH = 10
"""Queue size; each command replaces the one before."""


class DriveCommands:
    """Drives the car by published commands; a command holds for a moment only."""

    def __init__(
        self, node: Any, simulation: DrivenSimulation, faults: Faults, take_over: Callable[[], None]
    ) -> None:
        """``take_over`` is called when a command starts to drive the car."""
        self._node, self._simulation, self._faults, self._take_over = node, simulation, faults, take_over
        self._moving_topic: str | None = None
        """Topic of the last command, while it lets the car move."""
        self._velocity = TypedTopic(node, "cmd_vel", _VELOCITIES, self._on_velocity, _DEPTH)
        self._drive_name: str = node.resolve_topic_name("drive")
        kind = message_class(ACKERMANN)
        self._understands_drive = kind is not None
        if kind is not None:
            node.create_subscription(kind, "drive", self._on_drive, _DEPTH, raw=True)

    def forget(self) -> None:
        """Forget the last command, since something else drives the car."""
        self._moving_topic = None

    def watch_silence(self) -> None:
        """Report that commands have stopped, once the car brakes because of that."""
        if self._moving_topic is not None and not self._simulation.is_steered:
            self._faults.report(
                "silent",
                f"Commands have stopped coming on {self._moving_topic}: the car brakes.",
                lasting=False,
            )
            self._moving_topic = None

    def watch_types(self) -> None:
        """Subscribe to the published message type."""
        self._velocity.look()
        if self._velocity.strange:
            self._faults.report(
                "cmd_vel",
                f"The commands on {self._velocity.name} are of a type that is not supported: "
                f"{', '.join(self._velocity.strange)}; publish {' or '.join(_VELOCITIES)}.",
                lasting=False,
            )
        if not self._understands_drive and self._node.count_publishers(self._drive_name):
            self._faults.report(
                "drive",
                f"The commands on {self._drive_name} are not understood, as this ROS has no package "
                "ackermann_msgs; install it (with apt: ros-<distribution>-ackermann-msgs), or use "
                f"{self._velocity.name}.",
                lasting=False,
            )

    def _on_velocity(self, message: Any) -> None:
        twist = getattr(message, "twist", message)
        speed = twist.linear.x
        self._steer(self._velocity.name, speed, steering_for(speed, twist.angular.z))

    def _on_drive(self, serialized: bytes) -> None:
        message: Any = ros2_types().deserialize_cdr(serialized, ACKERMANN)
        self._steer(self._drive_name, message.drive.speed, message.drive.steering_angle)

    def _steer(self, topic: str, speed: float, steering: float) -> None:
        if not (math.isfinite(speed) and math.isfinite(steering)):
            self._faults.report(
                "command",
                f"A command on {topic} is left out: its speed or its turn is not a finite number.",
                lasting=False,
            )
            return
        top = self._simulation.conditions.max_speed
        if abs(speed) > top:
            self._faults.report(
                "fast",
                f"Commands on {topic} ask for more than the car's {top:g} m/s, at which it drives; the "
                "parameter max_speed raises that.",
                lasting=False,
            )
        self._take_over()
        self._simulation.steer(min(max(speed, -top), top), steering)
        self._moving_topic = None if speed == 0.0 else topic
