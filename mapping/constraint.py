"""What the pose graph is made of: a measured pose of one keyframe seen from another."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from maps.se2 import Pose

Kind = Literal["odometry", "scan_matching", "loop_closure"]


@dataclass(frozen=True, eq=False)
class Constraint:
    """An edge of the pose graph."""

    from_keyframe: int
    to_keyframe: int
    from_pose_to_pose: Pose
    """(3,) the second keyframe's pose in the frame of the first."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the second pose, as gtsam's BetweenFactorPose2 has it."""
    kind: Kind
