"""A constraint of the pose graph: the measured pose of one keyframe relative to another."""

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between

Kind = Literal["odometry", "scan_matching", "loop_closure", "manual"]
KINDS: tuple[Kind, ...] = get_args(Kind)
SAME_PASS = 39
"""Keyframes along the path within which two belong to one pass and are matched anyway. Chosen by judgement:
slightly more than the farthest predecessor matched."""
_ROWS, _COLUMNS = np.triu_indices(3)
"""Indices of the upper triangle of a symmetric matrix (3, 3), which determines it by definition."""
_OF_UPPER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""Index of each matrix entry among the six of the upper triangle, by definition of symmetry."""


@dataclass(frozen=True, eq=False)
class Constraint:
    """An edge of the pose graph."""

    from_keyframe: int
    to_keyframe: int
    from_pose_to_pose: Pose
    """(3,) pose of the second keyframe relative to the first."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the second keyframe, as in gtsam's BetweenFactorPose2."""
    kind: Kind

    def loosened(self, poses: Pose) -> "Constraint":
        """A weaker copy, which poses (K, 3) violate by at most one standard deviation."""
        missed = between(self.from_pose_to_pose, between(poses[self.from_keyframe], poses[self.to_keyframe]))
        return replace(self, information=self.information / (1.0 + missed @ self.information @ missed))


class ConstraintList:
    """A growing list of constraints that takes a fifth of the memory of objects. Of the symmetric information
    matrices, only the upper triangles are stored."""

    def __init__(self, constraints: Iterable[Constraint] = ()) -> None:
        self._ends, self._kinds = array("i"), array("b")
        self._poses, self._information = array("d"), array("d")
        for constraint in constraints:
            self.append(constraint)

    def __len__(self) -> int:
        return len(self._kinds)

    def __iter__(self) -> Iterator[Constraint]:
        arrays = self.to_arrays()
        ends, kinds = arrays["keyframes"].tolist(), arrays["kinds"].tolist()
        for (first, second), pose, information, kind in zip(
            ends, arrays["poses"], arrays["information"], kinds, strict=True
        ):
            yield Constraint(first, second, pose, information, KINDS[kind])

    def __getitem__(self, k: int) -> Constraint:
        pose, information = self._poses[3 * k : 3 * k + 3], self._information[6 * k : 6 * k + 6]
        first, second = self._ends[2 * k : 2 * k + 2]
        kind = KINDS[self._kinds[k]]
        return Constraint(first, second, np.array(pose), np.array(information)[_OF_UPPER], kind)

    def append(self, constraint: Constraint) -> None:
        """Append a constraint."""
        self._ends.extend((constraint.from_keyframe, constraint.to_keyframe))
        self._poses.extend(constraint.from_pose_to_pose)
        self._information.extend(constraint.information[_ROWS, _COLUMNS])
        self._kinds.append(KINDS.index(constraint.kind))

    @property
    def ends(self) -> NDArray[np.int32]:
        """(C, 2) keyframes that each constraint connects."""
        return np.array(self._ends, dtype=np.int32).reshape(-1, 2)

    def are(self, kind: Kind) -> NDArray[np.bool_]:
        """(C,) whether a constraint is of this kind."""
        are: NDArray[np.bool_] = np.array(self._kinds, dtype=np.int8) == KINDS.index(kind)
        return are

    def chosen(self, indices: Sequence[int] | NDArray[np.int64]) -> "ConstraintList":
        """The constraints at some indices, in that order."""
        return ConstraintList.from_arrays({name: rows[indices] for name, rows in self.to_arrays().items()})

    def among(self, keyframes: NDArray[np.bool_]) -> "ConstraintList":
        """The constraints between the selected keyframes (K,), renumbered accordingly."""
        arrays, number = self.to_arrays(), np.cumsum(keyframes) - 1
        left = keyframes[arrays["keyframes"]].all(axis=1)
        chosen = {name: rows[left] for name, rows in arrays.items()}
        return ConstraintList.from_arrays({**chosen, "keyframes": number[chosen["keyframes"]]})

    def since(self, start: int) -> "ConstraintList":
        """The constraints from index ``start`` on; the cost does not depend on the earlier ones."""
        later = ConstraintList()
        later._ends, later._kinds = self._ends[2 * start :], self._kinds[start:]
        later._poses, later._information = self._poses[3 * start :], self._information[6 * start :]
        return later

    def copy(self) -> "ConstraintList":
        """A deep copy."""
        return self.since(0)

    def cut(self, count: int) -> None:
        """Truncate to ``count`` constraints."""
        del self._ends[2 * count :], self._kinds[count:]
        del self._poses[3 * count :], self._information[6 * count :]

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """``keyframes`` (C, 2) int32, ``poses`` (C, 3), ``information`` (C, 3, 3) and ``kinds`` (C,) int8,
        indices into ``KINDS``."""
        return {
            "keyframes": self.ends,
            "poses": np.array(self._poses).reshape(-1, 3),
            "information": np.array(self._information).reshape(-1, 6)[:, _OF_UPPER],
            "kinds": np.array(self._kinds, dtype=np.int8),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> "ConstraintList":
        """Rebuild a list from `to_arrays`."""
        constraints = cls()
        constraints._ends.frombytes(arrays["keyframes"].astype(np.int32).tobytes())
        constraints._poses.frombytes(arrays["poses"].astype(np.float64).tobytes())
        information = arrays["information"].astype(np.float64)[:, _ROWS, _COLUMNS]
        constraints._information.frombytes(information.tobytes())
        constraints._kinds.frombytes(arrays["kinds"].astype(np.int8).tobytes())
        return constraints


def in_order(constraints: Iterable[Constraint]) -> list[Constraint]:
    """The constraints sorted by their second keyframes, as a pose graph takes them."""
    return sorted(constraints, key=lambda each: each.to_keyframe)
