"""Read a recording back into a scene to show."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.messages import decode, nanoseconds, rotation_matrix
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.runs.view.recorder import MAP_TOPIC, PARTICLES_TOPIC, POSE_TOPIC, SCAN_TOPIC
from racecar.pipelines.runs.view.scene import ParticleCloud, Scene, Sight
from racecar.sensors.scan import Scan

_MOST_SIGHTS = 4000
"""Longer runs show only every n-th scan, so that a browser can hold them."""
_PLANAR = np.array([0, 1, 5])
"""Rows and columns of x, y and yaw in the covariance of six coordinates."""


def read_record(path: Path, title: str, about: str) -> Scene:
    """The scene that ``--record`` wrote into a bag folder. Raises UserError when it cannot be read."""
    store = BagStore(path)
    try:
        topics = store.topics
        if POSE_TOPIC not in topics:
            raise UserError(f"{path} holds no {POSE_TOPIC}; name a run that was written with --record.")
        grid: OccupancyGrid | None = None
        stamps, poses, covariances = [], [], []
        clouds = []
        for name, _, data in store.messages([MAP_TOPIC, POSE_TOPIC, PARTICLES_TOPIC]):
            message = decode(topics[name], data)
            stamp = nanoseconds(message.header.stamp)
            if name == MAP_TOPIC:
                grid = _grid_of(message)
            elif name == PARTICLES_TOPIC:
                clouds.append(
                    ParticleCloud(stamp, np.array([_pose_of(pose) for pose in message.poses]).reshape(-1, 3))
                )
            else:
                stamps.append(stamp)
                poses.append(_pose_of(message.pose.pose))
                covariances.append(_planar_covariance(message.pose.covariance))
    finally:
        store.close()
    trajectory = Trajectory(np.array(stamps, dtype=np.int64), np.array(poses).reshape(-1, 3))
    return Scene(
        title,
        about,
        trajectory,
        grid,
        sights=_read_sights(path),
        clouds=clouds,
        covariances=np.array(covariances).reshape(-1, 3, 3),
    )


def _read_sights(path: Path) -> list[Sight]:
    with BagReader(path, scan_topic=SCAN_TOPIC, use_odometry=False) as reader:
        every = -(-reader.topics[SCAN_TOPIC].message_count // _MOST_SIGHTS)
        return [
            Sight(scan.stamp, scan.points_in_base().astype(np.float32))
            for index, scan in enumerate(reader)
            if index % every == 0 and isinstance(scan, Scan)
        ]


def _grid_of(message: Any) -> OccupancyGrid:
    info = message.info
    cells = np.asarray(message.data, dtype=np.int8).reshape(info.height, info.width)
    return OccupancyGrid(cells, float(info.resolution), _pose_of(info.origin))


def _pose_of(pose: Any) -> Pose:
    rotation = rotation_matrix(pose.orientation)
    yaw = 0.0 if rotation is None else np.arctan2(rotation[1, 0], rotation[0, 0])
    return np.array([pose.position.x, pose.position.y, yaw])


def _planar_covariance(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) covariance of x, y and yaw from (36,)."""
    planar: NDArray[np.float64] = np.asarray(covariance).reshape(6, 6)[np.ix_(_PLANAR, _PLANAR)]
    return planar
