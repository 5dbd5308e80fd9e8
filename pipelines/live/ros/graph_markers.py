"""The pose graph and the submaps as markers for RViz."""

from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import compose
from racecar.pipelines.live.ros.messages import header

_MOST_POINTS = 4000
"""Points of the path; more are thinned out."""
_BLUE, _RED, _GREEN = (0.2, 0.4, 0.9), (0.9, 0.1, 0.1), (0.1, 0.6, 0.2)


def graph_markers(stamp: Any, frame: str, session: Session) -> Any:
    """Keyframes as a line, loop closures between them, and a ball at the centre of each submap."""
    poses = compose(session.map_from_keyframe, session.keyframe_from_base)
    constraints = session.constraints
    ends = constraints.to_arrays()["keyframes"][constraints.are("loop_closure")].ravel()
    middles = np.array([submap.middle for submap in session.loops.submaps], dtype=np.int64)
    thinned = poses[:: 1 + len(poses) // _MOST_POINTS]
    return MarkerArray(
        markers=[
            _marker(stamp, frame, "keyframes", Marker.LINE_STRIP, 0.03, _BLUE, thinned),
            _marker(stamp, frame, "loop closures", Marker.LINE_LIST, 0.05, _RED, poses[ends]),
            _marker(stamp, frame, "submaps", Marker.SPHERE_LIST, 0.25, _GREEN, poses[middles]),
        ]
    )


def _marker(
    stamp: Any,
    frame: str,
    name: str,
    kind: int,
    size: float,
    color: tuple[float, float, float],
    points: NDArray[np.float64],
) -> Any:
    red, green, blue = color
    marker = Marker(
        header=header(stamp, frame),
        ns=name,
        type=kind,
        # A line of fewer than two points is an error in RViz.
        action=Marker.ADD if len(points) > 1 else Marker.DELETE,
        color=ColorRGBA(r=red, g=green, b=blue, a=1.0),
        lifetime=Duration(),
        points=[Point(x=float(x), y=float(y)) for x, y, *_ in points],
    )
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = size
    return marker
