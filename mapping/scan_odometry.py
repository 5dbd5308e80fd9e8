"""Scan odometry: KISS-ICP's registration against a rolling local map, seeded by a prediction.

Vizzo et al., "KISS-ICP: In Defense of Point-to-Point ICP", RA-L 2023. Used by its parts rather than
through its pipeline class, so that wheel odometry can be the initial guess and the local map grows
only at keyframes: a car that stands still then does not smear it.
"""

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.mapping import VoxelHashMap, get_voxel_hash_map
from kiss_icp.registration import Registration, get_registration
from kiss_icp.threshold import AdaptiveThreshold, get_threshold_estimator
from kiss_icp.voxelization import voxel_down_sample
from numpy.typing import NDArray

from maps.se2 import Pose, between

VOXEL_SIZE = 0.25
_LOCAL_MAP_RADIUS = 100.0
_UPDATE_DISTANCE = 0.2
_UPDATE_ANGLE = 0.1


class ScanOdometry:
    """Poses in an odometry frame of its own, from one scan to the next.

    They are kept in space: points of a planar scan leave them in the plane, those of a cloud do not.
    """

    def __init__(self) -> None:
        config = KISSConfig()
        config.data.max_range = _LOCAL_MAP_RADIUS
        config.mapping.voxel_size = VOXEL_SIZE
        config.adaptive_threshold.initial_threshold = 0.5
        config.adaptive_threshold.min_motion_th = 0.01
        config.registration.max_num_threads = 1
        self._threshold: AdaptiveThreshold = get_threshold_estimator(config)
        self._registration: Registration = get_registration(config)
        self._local_map: VoxelHashMap = get_voxel_hash_map(config)
        self._pose: NDArray[np.float64] = np.eye(4)
        self._updated_at: Pose | None = None

    def register(self, points: NDArray[np.float64], last_from_now: Pose) -> Pose:
        """Pose (3,) of the sensor in the odometry frame, seen from above.

        ``points`` (N, 2), or (N, 3) in space, in metres in the sensor frame, corrected for motion;
        ``last_from_now`` (3,) the motion since the last scan, as predicted.
        """
        guess = self._pose @ _to_matrix(last_from_now)
        self._pose = self._align(_in_space(points), guess) if len(points) else guess
        return _from_matrix(self._pose)

    def _align(self, points: NDArray[np.float64], guess: NDArray[np.float64]) -> NDArray[np.float64]:
        cloud = voxel_down_sample(points, 0.5 * VOXEL_SIZE)
        sigma = self._threshold.get_threshold()
        aligned: NDArray[np.float64] = self._registration.align_points_to_map(
            points=voxel_down_sample(cloud, 1.5 * VOXEL_SIZE),
            voxel_map=self._local_map,
            initial_guess=guess,
            max_correspondance_distance=3.0 * sigma,
            kernel=sigma,
        )
        self._threshold.update_model_deviation(np.linalg.inv(guess) @ aligned)
        self._update_local_map(cloud, aligned)
        return aligned

    def _update_local_map(self, cloud: NDArray[np.float64], matrix: NDArray[np.float64]) -> None:
        pose = _from_matrix(matrix)
        if self._updated_at is not None:
            moved = between(self._updated_at, pose)
            if np.hypot(moved[0], moved[1]) < _UPDATE_DISTANCE and abs(moved[2]) < _UPDATE_ANGLE:
                return
        self._local_map.update(cloud, matrix)
        self._updated_at = pose


def _in_space(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (N, 3); those of a plane at height zero."""
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])


def _to_matrix(pose: Pose) -> NDArray[np.float64]:
    matrix = np.eye(4)
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:2, 3] = pose[:2]
    return matrix


def _from_matrix(matrix: NDArray[np.float64]) -> Pose:
    return np.array([matrix[0, 3], matrix[1, 3], np.arctan2(matrix[1, 0], matrix[0, 0])])
