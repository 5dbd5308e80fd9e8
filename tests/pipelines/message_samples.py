"""Messages that the simulator does not send: clouds of points, and where things sit in space."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.bags.messages import POINT_CLOUD, TRANSFORMS, ros2_types

TYPES = ros2_types().types


def header(stamp: int, frame: str) -> Any:
    """Of ROS 2."""
    time = TYPES["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    return TYPES["std_msgs/msg/Header"](stamp=time, frame_id=frame)


def cloud(header: Any, names: Sequence[str], points: NDArray[np.float32], types: Any = TYPES) -> Any:
    """Points (N, F) with named fields, as drivers publish them."""
    field = types["sensor_msgs/msg/PointField"]
    return types[POINT_CLOUD](
        header=header,
        height=1,
        width=len(points),
        fields=[field(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(names)],
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=points.nbytes,
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )


def link(parent: str, child: str, place: Sequence[float], rotation: Sequence[float], stamp: int = 0) -> Any:
    """A message with one transform: x, y, z, and a quaternion from x to w."""
    x, y, z = map(float, place)
    transform = TYPES["geometry_msgs/msg/Transform"](
        translation=TYPES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z),
        rotation=TYPES["geometry_msgs/msg/Quaternion"](
            **dict(zip("xyzw", map(float, rotation), strict=True))
        ),
    )
    stamped = TYPES["geometry_msgs/msg/TransformStamped"](
        header=header(stamp, parent), child_frame_id=child, transform=transform
    )
    return TYPES[TRANSFORMS](transforms=[stamped])
