"""Trajectories from CSV files of several programs, and what can be wrong with them."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.files.pose_csv import load_pose_csv

SECOND = 1_700_000_000
"""Of the first pose, since 1970."""
QUARTER = "0.7071068"


def csv_file(folder: Path, text: str) -> Path:
    path = folder / "poses.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        f"t,x,y,yaw\n{SECOND}.5,1,2,1.5707963\n",
        f"x, y, theta, timestamp\n1, 2, 1.5707963, {SECOND}500\n",
        f"time;x_m;y_m;yaw_deg\n{SECOND}.5;1;2;90\n",
        f"Time [s]\tPos_X\tPos_Y\tYaw [deg]\n{SECOND}.5\t1\t2\t90\n",
        # EuRoC
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
        f"v_RS_R_x [m s^-1]\n{SECOND}500000000,1,2,3,{QUARTER},0,0,{QUARTER},9\n",
        # rostopic echo -p
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.pose.position.x,"
        "field.pose.pose.position.y,field.pose.pose.position.z,field.pose.pose.orientation.x,"
        "field.pose.pose.orientation.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w,"
        "field.pose.covariance0,field.twist.twist.linear.x\n"
        f"{SECOND}900000000,7,{SECOND}500000000,odom,1,2,0,0,0,{QUARTER},{QUARTER},0,5\n",
        # PlotJuggler
        "__time,/odom/header/stamp,/odom/pose/pose/orientation/w,/odom/pose/pose/orientation/x,"
        "/odom/pose/pose/orientation/y,/odom/pose/pose/orientation/yaw,/odom/pose/pose/orientation/z,"
        "/odom/pose/pose/position/x,/odom/pose/pose/position/y,/odom/twist/twist/linear/x\n"
        f"{SECOND}.9,{SECOND}.5,{QUARTER},0,0,1.57,{QUARTER},1,2,5\n",
        f"header.stamp.sec,header.stamp.nanosec,x,y,qx,qy,qz,qw\n{SECOND},500000000,1,2,0,0,1,1\n",
    ],
)
def test_columns_are_found_by_their_names(tmp_path: Path, text: str) -> None:
    trajectory = load_pose_csv(csv_file(tmp_path, text))
    assert trajectory.stamps.tolist() == [SECOND * 10**9 + 500_000_000]
    np.testing.assert_allclose(trajectory.map_from_base, [[1, 2, np.pi / 2]], atol=1e-6)


def test_a_drive_that_begins_at_zero_is_in_seconds(tmp_path: Path) -> None:
    trajectory = load_pose_csv(csv_file(tmp_path, "t,x,y,yaw\n0,0,0,0\n\n0.025,1,0,0\n"))
    assert trajectory.stamps.tolist() == [0, 25_000_000]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "is empty; its first line should name the columns"),
        ("t,x,y,yaw\n", "holds no poses"),
        ("0.1,1,2,0\n0.2,1,2,0\n", "No column of .* is t; .* names 0.1, 1, 2, 0"),
        ("t,x,yaw\n0,1,0\n", "No column of .* is y;"),
        ("t,x,y,qz,qw\n0,1,2,0,1\n", "No column of .* is yaw;"),
        (
            "t,/a/pos/x,/b/pos/x,y,yaw\n0,1,2,0,0\n",
            "could be x: /a/pos/x, /b/pos/x; keep one",
        ),
        ("t,x,y,yaw\n0,1,2,0\n1,2,3\n", "3 values in line 3 of .*, and 4 columns"),
        ("t,x,y,yaw\n0,1,,0\n", "The y in line 2 of .* is nothing, which is not a usable number"),
        ("t,x,y,yaw\n0,nan,2,0\n", "The x in line 2 of .* is nan"),
        ("t,x,y,yaw\n12:30:01,1,2,0\n", "The t in line 2 of .* is 12:30:01"),
        ("t,x,y,yaw\n1,1,2,0\n0,1,2,0\n", "line 3 of .* is not after the one before"),
        ("t,x,y,yaw\n0,1,2,90\n", "more than a full turn: name the column yaw_deg"),
        ("t,x,y,qx,qy,qz,qw\n0,1,2,0,0,0,0\n", "quaternion in line 2 of .* is 0 long"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, complaint: str) -> None:
    path = csv_file(tmp_path, text)
    with pytest.raises(UserError, match=complaint) as caught:
        load_pose_csv(path)
    assert str(path) in str(caught.value)
