import shlex

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.commands.options import join_laser_pose, parse_laser_pose


@pytest.mark.parametrize(
    ("typed", "joined"),
    [
        (
            "map a.bag --laser-pose 0.27 -1 0 --quiet",
            ["map", "a.bag", "--laser-pose", "0.27 -1 0", "--quiet"],
        ),
        ("--laser-pose 1 2 3 3.1416 5.bag", ["--laser-pose", "1 2 3 3.1416", "5.bag"]),
        ("--laser-pose '1 2 3' --out 7", ["--laser-pose", "1 2 3", "--out", "7"]),
        ("--initial-pose 1 2 3", ["--initial-pose", "1", "2", "3"]),
        ("", []),
    ],
)
def test_three_or_four_numbers_behind_the_flag_are_one_argument(typed: str, joined: list[str]) -> None:
    assert join_laser_pose(shlex.split(typed)) == joined


@pytest.mark.parametrize("text", ["0.27 -1 0", "0.27,-1,0", " 0.27  -1 0 "])
def test_a_place(text: str) -> None:
    assert parse_laser_pose(text) == (0.27, -1.0, 0.0)
    assert parse_laser_pose(f"{text} 3.1416") == (0.27, -1.0, 0.0, 3.1416)


@pytest.mark.parametrize("text", ["", "1", "1 2", "1 2 3 4 5", "a b c", "nan 0 0", "inf 0 0", "1e300 0 0"])
def test_no_place(text: str) -> None:
    with pytest.raises(UserError, match="--laser-pose"):
        parse_laser_pose(text)


@pytest.mark.parametrize(
    ("text", "slip"),
    [
        ("0.2 0 90", "1.5708 if these are degrees"),
        ("0.2 0 0 180", "3.1416 if these are degrees"),
        ("0.2 0 0 1", r"57°.* tilts the laser"),
    ],
)
def test_a_place_that_is_a_slip(text: str, slip: str) -> None:
    with pytest.raises(UserError, match=slip):
        parse_laser_pose(text)


@pytest.mark.parametrize("text", ["0.2 0 -4.712", "0.2 0 0 -3.1", "0.2 0 0 0.1"])
def test_a_place_that_may_be_meant(text: str) -> None:
    assert parse_laser_pose(text) == tuple(float(number) for number in text.split())
