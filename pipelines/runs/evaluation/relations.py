"""The metric of the SLAM benchmark: errors of relative poses (Kümmerle et al., Autonomous Robots 27, 2009).

A relation is the true pose of the car at time t2 relative to its pose at t1. Its error is ``inverse(true) ∘
estimated``, so the map's frame does not matter and no alignment is needed.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.table import columns_of, read_rows

_LAYOUT = "t1 t2 x y z roll pitch yaw"
_STAMP_TOLERANCE = 1_000_000
"""Nanoseconds. The files round to a microsecond; scans are at least 10 milliseconds apart."""


@dataclass(frozen=True, eq=False)
class Relations:
    """True relative poses."""

    stamps: NDArray[np.int64]
    """(N, 2) nanoseconds, t1 and t2."""
    first_from_second: Pose
    """(N, 3) pose at t2 relative to the pose at t1."""

    def __len__(self) -> int:
        return len(self.stamps)


@dataclass(frozen=True, eq=False)
class RelationErrors:
    """The error of each relation that a trajectory covers."""

    translations: NDArray[np.float64]
    """(M,) metres."""
    rotations: NDArray[np.float64]
    """(M,) radians, not negative."""
    lost: int
    """Number of relations without a pose at t1 or t2."""

    def summary(self) -> dict[str, float]:
        """Mean, standard deviation and mean square, in metres and degrees."""
        degrees = np.rad2deg(self.rotations)
        return {
            "relations": len(self.translations) + self.lost,
            "lost": self.lost,
            "translation_mean_m": float(np.mean(self.translations)),
            "translation_std_m": float(np.std(self.translations)),
            "translation_mean_square_m2": float(np.mean(self.translations**2)),
            "rotation_mean_deg": float(np.mean(degrees)),
            "rotation_std_deg": float(np.std(degrees)),
            "rotation_mean_square_deg2": float(np.mean(degrees**2)),
        }


def load_relations(path: Path) -> Relations:
    """Read a relations file. Raises UserError that names the faulty line."""
    first, second, *numbers = columns_of(_LAYOUT)
    rows = list(read_rows(path, _LAYOUT))
    if not rows:
        raise UserError(f"{path} holds no relations; it should hold lines '{_LAYOUT}'.")
    stamps = np.array([[row.stamp(first), row.stamp(second)] for row in rows], dtype=np.int64)
    poses = np.array([[row.number(column) for column in numbers] for row in rows])
    return Relations(stamps, poses[:, [0, 1, 5]])


def relation_errors(trajectory: Trajectory, relations: Relations) -> RelationErrors:
    """Compare a trajectory's relative poses, between its poses nearest to t1 and t2, with the true ones.

    Raises UserError when the trajectory covers none of the relations.
    """
    nearest = _nearest(trajectory.stamps, relations.stamps)
    found = np.all(np.abs(trajectory.stamps[nearest] - relations.stamps) <= _STAMP_TOLERANCE, axis=1)
    if not np.any(found):
        raise UserError(f"None of the {len(relations)} relations overlaps the trajectory in time.")
    first, second = nearest[found].T
    estimated = between(trajectory.map_from_base[first], trajectory.map_from_base[second])
    error = between(relations.first_from_second[found], estimated)
    return RelationErrors(
        translations=np.hypot(error[:, 0], error[:, 1]),
        rotations=np.abs(error[:, 2]),
        lost=int(np.sum(~found)),
    )


def missed_relations(found: Pose, true: Pose, first: NDArray[np.int64], second: NDArray[np.int64]) -> Pose:
    """(R, 3) errors ``inverse(true) ∘ found`` of the poses ``second`` (R,) relative to ``first`` (R,), both
    indices into the found (N, 3) and the true poses (N, 3)."""
    return between(between(true[first], true[second]), between(found[first], found[second]))


def _nearest(sorted_stamps: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
    right = np.clip(np.searchsorted(sorted_stamps, wanted), 1, max(len(sorted_stamps) - 1, 1))
    right = np.minimum(right, len(sorted_stamps) - 1)
    left = np.maximum(right - 1, 0)
    is_left = wanted - sorted_stamps[left] < sorted_stamps[right] - wanted
    return np.where(is_left, left, right)
