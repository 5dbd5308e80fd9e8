"""The pose of the car when its node stopped, and the place of its laser, for the next start."""

import hashlib
import time
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, Field, ValidationError

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.text_files import read_text
from racecar.pipelines.files.lenient import Lenient
from racecar.pipelines.files.report import write_json
from racecar.pipelines.live.intake.laser_place import LaserPlace, Square, Vector

_LONGEST_BRIDGE = 3600.0
"""Seconds over which the odometry may have kept counting. Chosen by judgement."""
_FASTEST = 10.0
"""Metres per second; no small car is as fast, so faster odometry was restarted meanwhile."""
_BEGINS_WITHIN = 0.5
"""Metres and radians from the odometry's origin within which it has just started. Chosen by judgement:
whoever listens from the start, or while the car stands, receives it there."""
_FAR_NEARER = 0.5
"""Share of the way from where the odometry was, within which its origin is far nearer. Chosen by judgement:
heard some seconds after a restart it is there, and few cars drive home meanwhile."""
_LEFT_WITHIN = (0.3, 0.3, 0.15)
"""Standard deviations (m, m, rad) of a pose without odometry since it was saved. Chosen by judgement, as the
car may have been pushed aside; if it was carried away, the scans do not fit."""
_DRIFT = 0.05
"""Standard deviation (m, rad) per metre driven meanwhile; wheels drift by 2 to 5 % in our logs."""


_MOST_BYTES = 100_000
"""Bytes of the file, a hundred times what is written."""


def _is_covariance(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    if not np.all(np.linalg.eigvalsh((matrix + matrix.T) / 2) >= 0.0):
        raise ValueError("it has negative variances")
    return matrix


class RememberedPose(Lenient):
    """A pose with the odometry at the same time, as stored in a file."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    map_from_base: Vector
    covariance: Annotated[Square, AfterValidator(_is_covariance)]
    odometry_stamp: Annotated[int, Field(ge=-(2**63), lt=2**63)] | None = None
    """Nanoseconds, of the message's header; None without odometry."""
    odom_from_base: Vector | None = None
    laser: LaserPlace | None = None
    """The laser's place."""

    def carried_to(self, stamp: int, odom_from_base: Pose) -> tuple[Pose, NDArray[np.float64]] | None:
        """The current pose (3,) and covariance (3, 3), if the odometry kept counting, or restarted
        since; or None."""
        if self.odometry_stamp is None or self.odom_from_base is None:
            return None
        seconds = (stamp - self.odometry_stamp) * 1e-9
        step = between(self.odom_from_base, odom_from_base)
        pose, covariance = self.map_from_base, self.covariance
        if _has_restarted(self.odom_from_base, odom_from_base):
            step, (pose, covariance) = odom_from_base, self.left_there
        distance = float(np.hypot(step[0], step[1]))
        if not 0.0 <= seconds < _LONGEST_BRIDGE or distance > _FASTEST * (seconds + 0.1):
            return None
        return compose(pose, step), covariance + np.eye(3) * (_DRIFT * distance) ** 2

    @property
    def left_there(self) -> tuple[Pose, NDArray[np.float64]]:
        """The pose (3,) and covariance (3, 3) of a car that was not moved."""
        return self.map_from_base, self.covariance + np.diag(np.square(_LEFT_WITHIN))


class PoseMemory:
    """One file per map."""

    def __init__(self, folder: Path, grid: OccupancyGrid) -> None:
        digest = hashlib.sha256(np.ascontiguousarray(grid.cells).tobytes())
        digest.update(repr((grid.resolution, grid.map_from_grid.tolist())).encode())
        self.path = folder / f"pose-{digest.hexdigest()[:16]}.json"

    def save(self, pose: RememberedPose) -> None:
        """Replace the stored pose. Raises UserError when the file cannot be written."""
        write_json(self.path, pose.model_dump())

    def load(self) -> RememberedPose | None:
        """The pose stored for this map, or None. Raises UserError when it is damaged."""
        if not self.path.is_file():
            return None
        try:
            pose = RememberedPose.model_validate_json(read_text(self.path, _MOST_BYTES))
        except ValidationError as error:
            raise UserError(
                f"{self.path} holds no remembered pose; remove it, or give the start yourself."
            ) from error
        if pose.odom_from_base is None or self.path.stat().st_mtime < _computer_began():
            return pose.model_copy(update={"odometry_stamp": None})  # odometry restarted, too
        return pose


def _has_restarted(before: Pose, now: Pose) -> bool:
    """Whether odometry restarted: it is where it begins, or far nearer to that than to where it was."""
    if _is_at_begin(now):
        return not _is_at_begin(before)
    return float(np.hypot(now[0], now[1])) < _FAR_NEARER * float(np.hypot(*(now - before)[:2]))


def _is_at_begin(odom_from_base: Pose) -> bool:
    x, y, yaw = odom_from_base
    return float(np.hypot(x, y)) < _BEGINS_WITHIN and abs(float(yaw)) < _BEGINS_WITHIN


def _computer_began() -> float:
    """Seconds since the epoch when this computer was booted."""
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)
