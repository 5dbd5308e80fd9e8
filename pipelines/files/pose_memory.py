"""The pose remembered over a restart: a small JSON file, replaced as a whole."""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.files.report import write_json
from racecar.pipelines.files.text_file import read_text


def save_pose(path: Path, estimate: PoseEstimate) -> None:
    """Write where the car is. Raises UserError when the place cannot be written to."""
    write_json(
        path,
        {
            "stamp": estimate.stamp,
            "map_from_base": estimate.map_from_base,
            "covariance": estimate.covariance,
        },
    )


def load_pose(path: Path) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) and covariance (3, 3) of a file. Raises UserError when it holds none."""
    try:
        contents = json.loads(read_text(path))
        pose = np.array(contents["map_from_base"], dtype=np.float64)
        covariance = np.array(contents["covariance"], dtype=np.float64)
    except (ValueError, TypeError, KeyError):
        pose, covariance = np.empty(0), np.empty(0)
    if pose.shape != (3,) or covariance.shape != (3, 3) or not np.isfinite([*pose, *covariance.flat]).all():
        raise UserError(f"{path} holds no remembered pose; remove it, or tell the start in another way.")
    return pose, covariance
