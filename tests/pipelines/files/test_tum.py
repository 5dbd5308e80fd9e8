from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import wrap_angle
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.tum import load_tum, save_tum

GOOD_LINE = "1.5 1 2 0 0 0 0 1"


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    stamps=st.lists(st.integers(0, 4 * 10**18), min_size=1, max_size=20, unique=True).map(sorted),
    pose=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3.14, 3.14)),
)
def test_round_trip(tmp_path: Path, stamps: list[int], pose: tuple[float, float, float]) -> None:
    written = Trajectory(np.array(stamps), np.tile(pose, (len(stamps), 1)))
    save_tum(written, tmp_path / "trajectory.tum")
    read = load_tum(tmp_path / "trajectory.tum")
    np.testing.assert_array_equal(read.stamps, written.stamps)
    difference = read.map_from_base - written.map_from_base
    np.testing.assert_allclose(difference[:, :2], 0, atol=1e-9)
    np.testing.assert_allclose(wrap_angle(difference[:, 2]), 0, atol=1e-9)


def test_yaw_of_a_tilted_pose_and_comments(tmp_path: Path) -> None:
    path = tmp_path / "reference.tum"
    # A quarter turn about z, then 0.2 rad about the car's own x axis.
    half, tilt = np.pi / 4, 0.1
    qx, qy = np.cos(half) * np.sin(tilt), np.sin(half) * np.sin(tilt)
    qz, qw = np.sin(half) * np.cos(tilt), np.cos(half) * np.cos(tilt)
    path.write_text(f"# time x y z qx qy qz qw\n\n976052905.567653 1 2 3 {qx} {qy} {qz} {qw}\n")
    trajectory = load_tum(path)
    assert trajectory.stamps.tolist() == [976052905_567653000]
    np.testing.assert_allclose(trajectory.map_from_base, [[1, 2, np.pi / 2]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "holds no poses"),
        (f"{GOOD_LINE}\n1.6 1 2", "line 2 of .* 8 values, and there are 3"),
        (f"{GOOD_LINE}\n\n1.6 1 two 0 0 0 0 1", "The y in line 3 of .* is two"),
        ("inf 1 2 0 0 0 0 1", "The t in line 1 of .* is inf, which is not a usable number"),
        ("1e400 1 2 0 0 0 0 1", "The t in line 1 of"),
        ("1e999999999 1 2 0 0 0 0 1", "The t in line 1 of"),
        ("nan 1 2 0 0 0 0 1", "The t in line 1 of"),
        ("snan 1 2 0 0 0 0 1", "The t in line 1 of"),
        ("1.5 1e308 2 0 0 0 0 1", "The x in line 1 of .* is 1e308"),
        ("1.5 1 2 0 0 0 1e-300 0", "quaternion in line 1 of .* is 1e-300 long"),
        ("1.5 0 0 0 1 30 40 0", "quaternion in line 1 of .* is 50 long"),
        ("1.5 nan 2 0 0 0 0 1", "The x in line 1 of .* is nan"),
        ("1.5 1 2 up 0 0 0 1", "The z in line 1 of .* is up"),
        ("1.5 1 2 0 0 0 0 0", "quaternion in line 1 of"),
        (f"{GOOD_LINE}\n{GOOD_LINE}", "line 2 of"),
    ],
)
def test_bad_files_name_the_line(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "bad.tum"
    path.write_text(text)
    with pytest.raises(UserError, match=complaint) as caught:
        load_tum(path)
    assert str(path) in str(caught.value)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="Cannot read"):
        load_tum(tmp_path / "absent.tum")
    with pytest.raises(UserError, match="Cannot read"):
        load_tum(tmp_path)
    (tmp_path / "binary.tum").write_bytes(bytes(range(256)))
    with pytest.raises(UserError, match="not a text file"):
        load_tum(tmp_path / "binary.tum")
