"""Places set by people: an initial pose, a clicked point, or a request for global localization."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
from numpy.typing import NDArray
from pydantic import Field
from std_srvs.srv import Empty

from racecar.localization.localizer import Localizer
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.settings import Settings
from racecar.pipelines.bags.messages import frame_name
from racecar.pipelines.live.ros.message_types import service_class
from racecar.pipelines.live.ros.messages import start_pose
from racecar.pipelines.live.ros.parameters import declare_settings
from racecar.pipelines.live.work.worker import Worker

_MOST_WAITING = 4
"""Requests, since a person clicks no faster."""


class _Clicks(Settings):
    """Accuracy of clicks."""

    clicked_radius: float = Field(
        1.0,
        gt=0.0,
        le=1000.0,
        description="metres to which a point clicked in RViz is taken to be exact",
    )


class _InitialPose(Settings):
    """Where the car is."""

    x: float = Field(0.0, description="metres on the map, where set_initial_pose is true")
    y: float = Field(0.0, description="the same")
    yaw: float = Field(0.0, description="radians, the same")


class _Start(Settings):
    """Where the car is at the start, as AMCL's parameters say it."""

    set_initial_pose: bool = Field(False, description="start from initial_pose")
    initial_pose: _InitialPose = _InitialPose()


def initial_pose(node: Any) -> Pose | None:
    """The pose (3,) that the parameters say the car starts from; None if they say nothing, or a node before
    on the same ROS node has started from it. Raises UserError that names the invalid parameter."""
    if node.has_parameter("set_initial_pose"):
        return None
    start = declare_settings(node, _Start(), read_only=True)
    pose = start.initial_pose
    return np.array([pose.x, pose.y, pose.yaw]) if start.set_initial_pose else None


class StartRequests:
    """Passes requests from the topics ``initialpose`` and ``clicked_point``, and from services called as
    AMCL's, to the localizer."""

    def __init__(
        self,
        node: Any,
        map_frame: str,
        worker: Worker,
        localizer: Callable[[], Localizer | None],
        inform: Callable[[str], None],
    ) -> None:
        """``localizer``: the current one, None before there is a map. Raises UserError that names the invalid
        parameter."""
        self._node, self._map_frame, self._worker = node, map_frame, worker
        self._localizer, self._inform = localizer, inform
        self._clicked_radius = declare_settings(node, _Clicks(), read_only=True).clicked_radius

    def start(self) -> None:
        """Create the subscriptions and the services."""
        node = self._node
        node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 10)
        node.create_subscription(PointStamped, "clicked_point", self._on_clicked_point, 10)
        node.create_service(Empty, "reinitialize_global_localization", self._on_global)
        node.create_service(Empty, "request_nomotion_update", self._on_update)
        if (kind := service_class("nav2_msgs", "SetInitialPose")) is not None:
            node.create_service(kind, "set_initial_pose", self._on_set_initial_pose)

    def start_from(self, map_from_base: Pose, covariance: NDArray[np.float64] | None) -> None:
        """Start from a pose (3,) with a covariance (3, 3), None for that of the settings; runs in the
        worker's thread. Raises UserError if the car cannot be there."""
        self._known_localizer().set_pose(map_from_base, covariance)
        x, y, yaw = map_from_base
        self._inform(f"Searching for the car near ({x:.2f}, {y:.2f}), heading {yaw:.2f} rad.")

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None) -> None:
        """Let the worker start from a pose, as `start_from` does."""
        self._worker.put("place", partial(self.start_from, map_from_base, covariance), _MOST_WAITING)

    def _on_initial_pose(self, message: Any) -> None:
        def work() -> None:
            self._check_frame(message)
            pose, covariance = start_pose(message)
            if covariance is None and np.any(message.pose.covariance):
                self._inform("The initial pose's covariance cannot be one: the settings' own is taken.")
            self.start_from(pose, covariance)

        self._worker.put("place", work, _MOST_WAITING)

    def _on_set_initial_pose(self, request: Any, response: Any) -> Any:
        self._on_initial_pose(request.pose)
        return response

    def _on_update(self, _request: Any, response: Any) -> Any:
        self._inform("An update without motion need not be requested: scans count while the car stands, too.")
        return response

    def _on_clicked_point(self, message: Any) -> None:
        def work() -> None:
            self._check_frame(message)
            point = np.array([message.point.x, message.point.y])
            self._known_localizer().set_position(point, self._clicked_radius)
            self._inform(f"Searching for the car near ({point[0]:.2f}, {point[1]:.2f}).")

        self._worker.put("place", work, _MOST_WAITING)

    def _on_global(self, _request: Any, response: Any) -> Any:
        def work() -> None:
            self._known_localizer().scatter()
            self._inform("Global localization: the car may be anywhere on the map.")

        self._worker.put("place", work, _MOST_WAITING)
        return response

    def _known_localizer(self) -> Localizer:
        localizer = self._localizer()
        if localizer is None:
            raise UserError("There is no map yet, so a place on it cannot be set.")
        return localizer

    def _check_frame(self, message: Any) -> None:
        frame = frame_name(message.header.frame_id)
        if frame not in ("", self._map_frame):
            raise UserError(
                f"A place given in the frame {frame!r} is left out; give it in {self._map_frame!r} "
                "(in RViz: Fixed Frame)."
            )
