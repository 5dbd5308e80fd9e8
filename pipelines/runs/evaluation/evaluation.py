"""Errors of a trajectory against a reference, computed by evo: absolute after alignment, and relative."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.alignment import rigid_alignment
from racecar.maps.geometry.se2 import Pose, compose, mean_angle
from racecar.maps.trajectory import Trajectory

_LONGEST_BRIDGE = 100_000_000
"""Maximum nanoseconds between two reference poses for interpolation."""
_SAME_TIME = 1_000_000
"""Nanoseconds. A reference pose this close is used, however far away its neighbours are."""
_RELATIVE_DISTANCE = 1.0
"""Metres of path over which the relative error is measured."""


@dataclass(frozen=True, eq=False)
class TrajectoryErrors:
    """Errors of a trajectory against a reference."""

    matched: int
    """Number of poses that the reference covers."""
    total: int
    """Number of poses of the trajectory."""
    reference_from_map: Pose
    """(3,) the alignment: least squares over the matched positions, without scale."""
    seconds: NDArray[np.float64]
    """(M,) time of each matched pose, since the start of the trajectory."""
    map_from_base: Pose
    """(M, 3) the matched poses of the trajectory, before alignment."""
    reference_from_base: Pose
    """(M, 3) the poses of the reference at the same times."""
    positions: NDArray[np.float64]
    """(M,) metres, absolute position error of each matched pose after alignment."""
    headings: NDArray[np.float64]
    """(M,) radians, absolute heading error of each matched pose after alignment."""
    relative_positions: NDArray[np.float64]
    """(P,) metres, error of the relative pose over 1 m of path; empty when the path is shorter."""
    relative_headings: NDArray[np.float64]
    """(P,) radians."""

    def summary(self) -> dict[str, Any]:
        """The figures for people and for report.json; metres and degrees."""
        return {
            "poses": self.total,
            "matched_poses": self.matched,
            "matched_share": self.matched / self.total,
            "absolute_position_m": _statistics(self.positions),
            "absolute_heading_deg": _statistics(np.rad2deg(self.headings)),
            "relative_position_m_per_1m": _statistics(self.relative_positions),
            "relative_heading_deg_per_1m": _statistics(np.rad2deg(self.relative_headings)),
        }


def compare(
    estimated: Trajectory, reference: Trajectory, *, reference_from_map: Pose | None = None
) -> TrajectoryErrors:
    """Errors of a trajectory, aligned to the reference unless the alignment (3,) is given.

    The reference is interpolated at the stamps of the trajectory; poses it does not cover are left out.
    Raises UserError when it covers none.
    """
    rows, reference_poses = _reference_at(estimated.stamps, reference)
    if not len(rows):
        raise UserError(
            "The trajectory and the reference have no time in common; "
            f"one covers {_span(estimated)}, the other {_span(reference)}."
        )
    poses = estimated.map_from_base[rows]
    if reference_from_map is None:
        reference_from_map = align(poses, reference_poses)
    aligned = compose(reference_from_map, poses)
    stamps = estimated.stamps[rows]
    positions, headings = _absolute_errors(stamps, aligned, reference_poses)
    relative_positions, relative_headings = _relative_errors(stamps, aligned, reference_poses)
    return TrajectoryErrors(
        matched=len(rows),
        total=len(estimated),
        reference_from_map=reference_from_map,
        seconds=(stamps - estimated.stamps[0]) * 1e-9,
        map_from_base=poses,
        reference_from_base=reference_poses,
        positions=positions,
        headings=headings,
        relative_positions=relative_positions,
        relative_headings=relative_headings,
    )


def align(map_from_base: Pose, reference_from_base: Pose) -> Pose:
    """``reference_from_map`` (3,): the planar rigid motion that best aligns positions (N, 3) with others. If
    the car did not move, the rotation is computed from the headings."""
    turn = mean_angle(reference_from_base[:, 2] - map_from_base[:, 2])
    return rigid_alignment(map_from_base[:, :2], reference_from_base[:, :2], turn)


def _reference_at(stamps: NDArray[np.int64], reference: Trajectory) -> tuple[NDArray[np.int64], Pose]:
    """Which of the stamps the reference covers, and its poses at those."""
    times, last = reference.stamps, len(reference) - 1
    right = np.clip(np.searchsorted(times, stamps), min(1, last), last)
    left = np.maximum(right - 1, 0)
    span = np.maximum(times[right] - times[left], 1)
    inside = (times[left] <= stamps) & (stamps <= times[right]) & (span <= _LONGEST_BRIDGE)
    beside = np.minimum(np.abs(stamps - times[left]), np.abs(stamps - times[right])) <= _SAME_TIME
    rows = np.flatnonzero(inside | beside)
    return rows, reference.poses_at(stamps[rows])


def _absolute_errors(
    stamps: NDArray[np.int64], aligned: Pose, reference: Pose
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    from evo.core.metrics import APE

    return _measure(APE, stamps, aligned, reference)


def _relative_errors(
    stamps: NDArray[np.int64], aligned: Pose, reference: Pose
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    from evo.core.metrics import RPE, Unit

    if np.sum(np.hypot(*np.diff(reference[:, :2], axis=0).T)) < 2 * _RELATIVE_DISTANCE:
        return np.empty(0), np.empty(0)
    per_metre = partial(RPE, delta=_RELATIVE_DISTANCE, delta_unit=Unit.meters, pairs_from_reference=True)
    return _measure(per_metre, stamps, aligned, reference)


def _measure(
    make_metric: Callable[..., Any], stamps: NDArray[np.int64], aligned: Pose, reference: Pose
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One of evo's metrics, for the positions (m) and for the headings (rad)."""
    from evo.core.metrics import PoseRelation

    pair = (_as_evo(stamps, reference), _as_evo(stamps, aligned))
    errors = []
    for relation in (PoseRelation.translation_part, PoseRelation.rotation_angle_rad):
        metric = make_metric(relation)
        metric.process_data(pair)
        errors.append(np.asarray(metric.error, dtype=np.float64))
    return errors[0], errors[1]


def _as_evo(stamps: NDArray[np.int64], poses: Pose) -> Any:
    from evo.core.trajectory import PoseTrajectory3D

    zeros = np.zeros(len(poses))
    positions = np.column_stack([poses[:, :2], zeros])
    half = poses[:, 2] / 2
    quaternions = np.column_stack([np.cos(half), zeros, zeros, np.sin(half)])
    seconds = (stamps - stamps[0]) * 1e-9
    return PoseTrajectory3D(positions, quaternions, seconds)


def _statistics(errors: NDArray[np.float64]) -> dict[str, float] | None:
    if not len(errors):
        return None
    return {
        "mean": float(np.mean(errors)),
        "median": float(np.median(errors)),
        "rmse": float(np.sqrt(np.mean(errors**2))),
        "std": float(np.std(errors)),
        "max": float(np.max(errors)),
    }


def _span(trajectory: Trajectory) -> str:
    return f"{trajectory.stamps[0] * 1e-9:.3f} to {trajectory.stamps[-1] * 1e-9:.3f} s"
