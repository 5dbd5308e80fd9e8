"""Goals on ``goal_pose``, RViz's 2D Goal Pose: the car plans a path to them and follows it."""

from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse
from racecar.pipelines.bags.converters.odometry import pose_in_plane
from racecar.pipelines.bags.converters.transforms import ends_of, matrix_of, seen_from_above
from racecar.pipelines.bags.messages import TRANSFORMS, frame_name, ros2_types
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.message_types import transform_message_type
from racecar.pipelines.live.simulated_car.car_topics import FrameNames
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation

_SHORT = 0.25
"""Metres from the goal at which the path may end without a warning: more than the spacing of the planner's
places."""
_PATIENCE = 5.0
"""Seconds for which the car may stand without a warning. Chosen by judgement, as people walk by."""
_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE)


class Goals:
    """Goals are interpreted as on a real car, relative to its estimated pose: if a node publishes the car's
    pose in the goal's frame, the goal is as far from the true car as from that pose. Otherwise the map is the
    simulated one."""

    def __init__(
        self,
        node: Any,
        frames: FrameNames,
        simulation: DrivenSimulation,
        faults: Faults,
        inform: Callable[[str], None],
        take_over: Callable[[], None],
    ) -> None:
        """``take_over`` is called when the car starts to drive to a goal."""
        self._take_over = take_over
        self._frames, self._simulation, self._faults, self._inform = frames, simulation, faults, inform
        self._links = MapLinks(node, frames.odom)
        self._is_awaited = False
        self._moved_at = 0.0
        """Simulated seconds when the car last moved."""
        self.odom_from_base: Pose = IDENTITY
        """(3,) by the current odometry."""
        node.create_subscription(PoseStamped, "goal_pose", self._on_goal, 10)

    def forget(self) -> None:
        """Forget the goal, since something else drives the car."""
        self._is_awaited = False

    def watch_way(self) -> None:
        """Report when the car reaches its goal, or is stuck; to be called at every step."""
        simulation = self._simulation
        if not self._is_awaited:
            return
        if simulation.speed != 0.0:
            self._moved_at = simulation.seconds
        if not simulation.is_underway:
            self._is_awaited = False
            self._inform("The car has arrived at the goal.")
        elif simulation.seconds - self._moved_at > _PATIENCE:
            self._faults.report(
                "stuck",
                "The car stands still on its way to the goal: a wall or a person is in its way. Drive it "
                "free with commands, or send another goal.",
                lasting=False,
            )

    def _on_goal(self, message: Any) -> None:
        goal = pose_in_plane(message.pose)
        try:
            if goal is None:
                raise UserError("Its position or its quaternion is not valid.")
            self._drive_to(self._in_simulated_map(frame_name(message.header.frame_id), goal))
        except UserError as error:
            self._faults.report("goal", f"The goal is left out. {error}", lasting=False)

    def _drive_to(self, map_from_goal: Pose) -> None:
        simulation = self._simulation
        simulation.drive_to(map_from_goal)
        self._take_over()
        self._is_awaited, self._moved_at = True, simulation.seconds
        end = simulation.planned[-1] if simulation.is_underway else simulation.truth[:2]
        left = float(np.linalg.norm(end - map_from_goal[:2]))
        if left > _SHORT:
            self._faults.report(
                "goal",
                f"The car cannot stand at the goal: it stops {left:.1f} m away from it.",
                lasting=False,
            )

    def _in_simulated_map(self, frame: str, frame_from_goal: Pose) -> Pose:
        """``map_from_goal`` (3,). Raises UserError if the goal's frame is unknown."""
        frames = self._frames
        frame_from_odom = IDENTITY if frame == frames.odom else self._links.frame_from_odom(frame)
        if frame == frames.base:
            base_from_frame = IDENTITY
        elif frame_from_odom is not None:
            base_from_frame = inverse(compose(frame_from_odom, self.odom_from_base))
        elif frame in ("", frames.map):
            return frame_from_goal
        else:
            raise UserError(
                f"Its frame {frame} is not known; give it in {frames.map}, {frames.odom} or {frames.base}."
            )
        return compose(self._simulation.truth, compose(base_from_frame, frame_from_goal))


class MapLinks:
    """Receives on ``/tf`` the pose of the car's odometry frame in other frames."""

    def __init__(self, node: Any, odom_frame: str) -> None:
        self._odom_frame = odom_frame
        self._frame_from_odom: dict[str, Pose] = {}
        node.create_subscription(transform_message_type(), "/tf", self._take, _QOS, raw=True)

    def frame_from_odom(self, frame: str) -> Pose | None:
        """(3,), the latest; None if none was published."""
        return self._frame_from_odom.get(frame)

    def _take(self, serialized: bytes) -> None:
        message: Any = ros2_types().deserialize_cdr(serialized, TRANSFORMS)
        for transform in message.transforms:
            parent, child = ends_of(transform)
            matrix = matrix_of(transform) if child == self._odom_frame else None
            if matrix is not None:
                self._frame_from_odom[parent] = seen_from_above(matrix)
