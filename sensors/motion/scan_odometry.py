"""Scan odometry: KISS-ICP's registration against a rolling local map, seeded by a prediction.

Vizzo et al., "KISS-ICP: In Defense of Point-to-Point ICP", RA-L 2023. Uses its components rather than its
pipeline class, so that wheel odometry can be the initial guess and the local map grows only as the sensor
moves: a standing car does not smear it.
"""

from collections import deque

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.mapping import VoxelHashMap, get_voxel_hash_map
from kiss_icp.registration import Registration, get_registration
from kiss_icp.threshold import AdaptiveThreshold, get_threshold_estimator
from kiss_icp.voxelization import voxel_down_sample
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.sensors.motion.upright import upright_points

_VOXEL = 0.25
"""Voxel size of the local map, metres. Measured when chosen: KISS-ICP's own 1.0 fails indoors, 0.1 to 0.25
work."""
_POINTS_PER_VOXEL = 6
"""Points per voxel. KISS-ICP's 20 is for 3D clouds; measured on aces, fr079 and intel, 6 gives the same
errors in a sixth less time."""
_RADIUS = 100.0
"""Radius of the local map, metres: beyond the range of indoor lasers, because a shorter one loses the ends of
corridors."""
_UPDATE_AFTER = 0.2, 0.1
"""Metres or radians after which a scan is added to the local map, so that a standing car cannot smear it."""
_INITIAL_THRESHOLD = 0.5
"""Initial guess of the error of predictions, metres, which KISS-ICP then adapts. Chosen by judgement: a
quarter of its outdoor 2.0."""
_MIN_MOTION = 0.01
"""Minimum error in metres that adapts this threshold. Chosen by judgement: the noise of a laser."""
_LATEST_UPDATES = 60
"""Updates of the local map kept when older ones are dropped. Chosen by judgement: 12 m of path or more, as
long as most rooms."""


class ScanOdometry:
    """Tracks poses from scan to scan in its own odometry frame.

    In the local map a multi-row sensor can also move in height, roll and pitch, and drifts there. The
    reported motion lies in its own level plane, which that drift does not affect.
    """

    def __init__(self) -> None:
        self._kiss = kiss = KISSConfig()
        kiss.data.max_range = _RADIUS
        kiss.mapping.voxel_size = _VOXEL
        kiss.mapping.max_points_per_voxel = _POINTS_PER_VOXEL
        kiss.adaptive_threshold.initial_threshold = _INITIAL_THRESHOLD
        kiss.adaptive_threshold.min_motion_th = _MIN_MOTION
        kiss.registration.max_num_threads = 1
        self._threshold: AdaptiveThreshold = get_threshold_estimator(kiss)
        self._registration: Registration = get_registration(kiss)
        self._local_map: VoxelHashMap = get_voxel_hash_map(kiss)
        self._local_from_sensor: NDArray[np.float64] = np.eye(4)
        self._local_from_updated: NDArray[np.float64] | None = None
        self._updates: deque[tuple[NDArray[np.float64], NDArray[np.float64]]] = deque(maxlen=_LATEST_UPDATES)
        self._pose: Pose = IDENTITY

    def __reduce__(self) -> tuple[type["ScanOdometry"], tuple[()]]:
        """A copy starts from scratch, as KISS-ICP's components cannot be copied."""
        return ScanOdometry, ()

    def forget_old(self) -> None:
        """Keep only the latest updates of the local map, since older ones are off by the drift since then;
        and start to learn the error of predictions from scratch."""
        self._kiss.adaptive_threshold.initial_threshold = self._threshold.get_threshold()
        self._threshold = get_threshold_estimator(self._kiss)
        self._local_map = get_voxel_hash_map(self._kiss)
        for cloud, local_from_sensor in self._updates:
            self._local_map.update(cloud, local_from_sensor)

    def register(self, points: NDArray[np.float64], last_from_now: Pose) -> Pose:
        """Pose (3,) of the sensor in the odometry frame.

        ``points`` (N, 2), or (N, 3) with z up, in metres in the sensor frame, corrected for motion; all calls
        use the same dimension. ``last_from_now`` (3,) is the predicted motion since the last scan.
        """
        last, guess = self._local_from_sensor, self._local_from_sensor @ _to_matrix(last_from_now)
        in_space = upright_points(points) if points.shape[1] == 3 else _at_height_zero(points)
        self._local_from_sensor = self._align(in_space, guess) if len(in_space) else guess
        self._pose = compose(self._pose, _motion(last, self._local_from_sensor))
        return self._pose

    def _align(self, points: NDArray[np.float64], guess: NDArray[np.float64]) -> NDArray[np.float64]:
        # KISS-ICP's own factors: half a voxel for the map, one and a half for registration, three sigmas.
        cloud = voxel_down_sample(points, 0.5 * _VOXEL)
        sigma = self._threshold.get_threshold()
        aligned: NDArray[np.float64] = self._registration.align_points_to_map(
            points=voxel_down_sample(cloud, 1.5 * _VOXEL),
            voxel_map=self._local_map,
            initial_guess=guess,
            max_correspondance_distance=3.0 * sigma,
            kernel=sigma,
        )
        self._threshold.update_model_deviation(_between(guess, aligned))
        if self._local_from_updated is None or _is_far(_motion(self._local_from_updated, aligned)):
            self._update(cloud, aligned)
        return aligned

    def _update(self, cloud: NDArray[np.float64], local_from_sensor: NDArray[np.float64]) -> None:
        self._local_map.update(cloud, local_from_sensor)
        self._local_from_updated = local_from_sensor
        self._updates.append((cloud, local_from_sensor))


def _is_far(motion: Pose) -> bool:
    """Whether the sensor has moved far enough since the last update of the local map for another one."""
    distance, angle = _UPDATE_AFTER
    return bool(np.hypot(motion[0], motion[1]) >= distance or abs(motion[2]) >= angle)


def _at_height_zero(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack([points, np.zeros(len(points))])


def _motion(world_from_a: NDArray[np.float64], world_from_b: NDArray[np.float64]) -> Pose:
    """``a_from_b`` (3,) of two poses (4, 4) in space, projected to the plane."""
    a_from_b = _between(world_from_a, world_from_b)
    return np.array([a_from_b[0, 3], a_from_b[1, 3], np.arctan2(a_from_b[1, 0], a_from_b[0, 0])])


def _between(world_from_a: NDArray[np.float64], world_from_b: NDArray[np.float64]) -> NDArray[np.float64]:
    a_from_world = world_from_a[:3, :3].T
    a_from_b = np.eye(4)
    a_from_b[:3, :3] = a_from_world @ world_from_b[:3, :3]
    a_from_b[:3, 3] = a_from_world @ (world_from_b[:3, 3] - world_from_a[:3, 3])
    return a_from_b


def _to_matrix(pose: Pose) -> NDArray[np.float64]:
    matrix = np.eye(4)
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:2, 3] = pose[:2]
    return matrix
