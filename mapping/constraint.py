"""What the pose graph is made of: a measured pose of one keyframe seen from another."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import Arrays
from maps.se2 import Pose

Kind = Literal["odometry", "scan_matching", "loop_closure"]


@dataclass(frozen=True, eq=False, slots=True)
class Constraint:
    """An edge of the pose graph."""

    from_keyframe: int
    to_keyframe: int
    from_pose_to_pose: Pose
    """(3,) the second keyframe's pose in the frame of the first."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the second pose, as gtsam's BetweenFactorPose2 has it."""
    kind: Kind


def to_arrays(constraints: Sequence[Constraint]) -> Arrays:
    """Constraints as arrays; a kind is its place in ``Kind``."""
    kinds = get_args(Kind)
    return {
        "keyframes": np.array([[c.from_keyframe, c.to_keyframe] for c in constraints], np.int32).reshape(
            -1, 2
        ),
        "poses": np.array([c.from_pose_to_pose for c in constraints]).reshape(-1, 3),
        "information": np.array([c.information for c in constraints]).reshape(-1, 3, 3),
        "kinds": np.array([kinds.index(c.kind) for c in constraints], dtype=np.int8),
    }


def from_arrays(arrays: Arrays) -> list[Constraint]:
    """The constraints that were written so."""
    kinds: tuple[Kind, ...] = get_args(Kind)
    poses, information = arrays["poses"].astype(np.float64), arrays["information"].astype(np.float64)
    return [
        Constraint(a, b, pose, matrix, kinds[kind])
        for (a, b), pose, matrix, kind in zip(
            arrays["keyframes"].tolist(), poses, information, arrays["kinds"].tolist(), strict=True
        )
    ]
