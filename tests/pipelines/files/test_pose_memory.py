from pathlib import Path

import numpy as np
import pytest

from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.errors import UserError
from racecar.pipelines.files.pose_memory import load_pose, save_pose


def test_what_was_saved_is_loaded(tmp_path: Path) -> None:
    pose, covariance = np.array([1.25, -3.5, 0.1 + 0.2]), np.diag([0.01, 0.02, 1e-5])
    for share in (0.0, 1.0):  # the second replaces the first
        estimate = PoseEstimate(10**18 + 1, share * pose, covariance, 1.0, 100.0, 100, False, 0.0)
        save_pose(tmp_path / "pose.json", estimate)
    loaded_pose, loaded_covariance = load_pose(tmp_path / "pose.json")
    assert loaded_pose.tobytes() == pose.tobytes()
    assert loaded_covariance.tobytes() == covariance.tobytes()
    assert [path.name for path in tmp_path.iterdir()] == ["pose.json"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "7",
        "{}",
        '{"map_from_base": "x"}',
        '{"map_from_base": [1, 2], "covariance": [[1]]}',
        '{"map_from_base": [1, 2, null], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}',
    ],
)
def test_a_file_of_another_kind_is_a_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "pose.json"
    path.write_text(text)
    with pytest.raises(UserError, match="no remembered pose"):
        load_pose(path)


def test_no_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="Cannot read"):
        load_pose(tmp_path / "none.json")
