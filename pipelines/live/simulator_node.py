"""The ROS 2 node of a simulated car: it drives in a simulated world, and publishes its sensor readings."""

import time
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.clock import Clock, ClockType

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import frame_name
from racecar.pipelines.live.monitoring.diagnostics import Diagnostics
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.messages import start_pose
from racecar.pipelines.live.ros.parameters import declare_settings, watch_settings
from racecar.pipelines.live.simulated_car.car_topics import CarTopics, FrameNames
from racecar.pipelines.live.simulated_car.drive_commands import DriveCommands
from racecar.pipelines.live.simulated_car.goals import Goals
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.simulation.driver import TICK
from racecar.pipelines.simulation.wheel_odometry import PERIOD_TICKS
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_PERIOD = PERIOD_TICKS * TICK
"""Simulated seconds of a step, after each of which the wheels report."""
_SHORTEST_TIMER = 0.005
"""Seconds; at a faster pace several steps are made at once."""
_HELD_UP = 0.5
"""Seconds of wall time that are caught up with. Beyond that simulated time falls behind, so that a delayed
car does not leap. Planning a path takes less."""
_LOADING = 0.1
"""Simulated seconds within which the laser has measured."""


class SimulatorNode:
    """Drives by goals and commands. All callbacks run in one thread, so no locks are needed."""

    def __init__(
        self,
        node: Any,
        simulation: DrivenSimulation,
        *,
        pace: float,
        teleports: bool,
    ) -> None:
        """``pace``: simulated seconds per second of wall time; ``teleports``: whether ``initialpose`` moves
        the car.

        Raises UserError that names the invalid parameter.
        """
        self.node, self.faults = node, Faults(self._warn, self._inform)
        self._simulation, self._pace = simulation, pace
        simulation.conditions = declare_settings(node, simulation.conditions)
        self._frames = FrameNames.in_namespace(node.get_namespace())
        self._topics = CarTopics(node, self._frames, simulation.laser)
        self._goals = Goals(
            node, self._frames, simulation, self.faults, self._inform, lambda: self._commands.forget()
        )
        self._commands = DriveCommands(node, simulation, self.faults, self._goals.forget)
        if teleports:
            node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 10)
        self._diagnostics = Diagnostics(node, "simulator")
        self._began, self._steps = 0.0, 0
        self._reported = 0.0, 0

    def start(self) -> None:
        """Start to drive; simulated time starts at the computer's time."""
        node, simulation = self.node, self._simulation
        watch_settings(node, lambda: simulation.conditions, self._take_conditions)
        _load_kernels(simulation)
        simulation.start_ns = time.time_ns() - round(simulation.seconds * 1e9)
        # Half a step early, so that a timer that is slightly early or late still makes one step.
        self._began = time.monotonic() - 0.5 * _PERIOD / self._pace
        self._reported = time.monotonic(), 0
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(max(_PERIOD / self._pace, _SHORTEST_TIMER), self._go_on, clock=steady)
        node.create_timer(0.5, self._commands.watch_types, clock=steady)
        node.create_timer(1.0, self._report, clock=steady)
        x, y, yaw = simulation.truth.tolist()
        self._inform(f"Ready: the car stands at x {x:.2f} m, y {y:.2f} m, yaw {yaw:.2f} rad of the map.")

    def _go_on(self) -> None:
        """Make the steps that are due."""
        due = self._steps_due()
        most = max(1, int(_HELD_UP * self._pace / _PERIOD))
        if due > most:
            self._began += (due - most) * _PERIOD / self._pace
            self.faults.report(
                "slow",
                "The computer is too slow for this pace: simulated time stays behind; give a smaller --pace.",
                lasting=False,
            )
        for _ in range(min(due, most)):
            self._step()

    def _steps_due(self) -> int:
        return int((time.monotonic() - self._began) * self._pace / _PERIOD) - self._steps

    def _step(self) -> None:
        simulation = self._simulation
        self._steps += 1
        for measured in simulation.advance(_PERIOD):
            if isinstance(measured, Odometry):
                self._goals.odom_from_base = measured.odom_from_base
                twist = np.array([simulation.speed, 0.0, simulation.turning_speed])
                self._topics.publish_odometry(measured)
                self._topics.publish_truth(measured.stamp, simulation.truth, twist)
            elif isinstance(measured, Scan):
                self._topics.publish_scan(measured)
        self._commands.watch_silence()
        self._goals.watch_way()

    def _on_initial_pose(self, message: Any) -> None:
        frame = frame_name(message.header.frame_id)
        try:
            if frame not in ("", self._frames.map):
                raise UserError(
                    f"The initial pose is left out: give it in {self._frames.map}, not in {frame}."
                )
            self._simulation.put_at(start_pose(message)[0])
            self._goals.forget()
            self._commands.forget()
        except UserError as error:
            self.faults.report("initial_pose", str(error), lasting=False)

    def _take_conditions(self, conditions: Conditions) -> None:
        self._simulation.conditions = conditions

    def _report(self) -> None:
        simulation, now = self._simulation, time.monotonic()
        (then, steps), self._reported = self._reported, (now, self._steps)
        x, y, yaw = simulation.truth.tolist()
        figures = {
            "x (m)": x,
            "y (m)": y,
            "yaw (rad)": yaw,
            "speed (m/s)": simulation.speed,
            "is on its way to a goal": simulation.is_underway,
            "simulated seconds": simulation.seconds,
            "simulated seconds in one of the computer's": (self._steps - steps) * _PERIOD / (now - then),
        }
        self._diagnostics.publish(self.faults.sentences, figures)

    def _inform(self, sentence: str) -> None:
        self.node.get_logger().info(sentence)

    def _warn(self, sentence: str) -> None:
        self.node.get_logger().warning(sentence)


def _load_kernels(simulation: DrivenSimulation) -> None:
    """Plan, move and measure briefly, since the first time takes a second or two."""
    simulation.drive_to(simulation.truth)
    simulation.advance(_LOADING)
