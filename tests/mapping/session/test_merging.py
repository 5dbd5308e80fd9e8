"""A drive is joined to an earlier map where it was found, if it really lies there, or it is said why not."""

import re
from functools import cache

import numpy as np
import pytest

from racecar.mapping.graph import pose_graph
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from tests.mapping.sessions import BARE_RING, RING, path, session
from tests.sensors.worlds import box

ELSEWHERE = np.array([40.0, -25.0, 2.5])
EARLIER_LASER, LATER_LASER = np.array([0.3, 0.0, 0.0]), np.array([-0.1, 0.05, 3.0])

FIRST, SECOND = path(0.0, 34.0), path(11.0, 20.0)
TRUE = np.concatenate([FIRST, SECOND])


@cache
def earlier_drive() -> Session:
    return session(RING, FIRST, IDENTITY, EARLIER_LASER)


def later_drive(walls: np.ndarray = RING) -> Session:
    return session(walls, SECOND, ELSEWHERE, LATER_LASER)


def merged(earlier: Session, later: Session, start: Pose | None = None) -> Session:
    return merge(EarlierMap(earlier, start), later)


@pytest.fixture(scope="module")
def joint() -> Session:
    """What both drives make."""
    return merged(earlier_drive(), later_drive())


def test_the_later_drive_lies_where_it_was(joint: Session) -> None:
    assert np.abs(between(TRUE, joint.map_from_keyframe)).max() < 0.01
    loops = [c for c in joint.constraints if c.kind == "loop_closure"]
    assert loops
    for c in loops:
        assert c.from_keyframe < len(FIRST) <= c.to_keyframe
    assert len(joint.rays) == len(joint.keyframes) == len(TRUE)


def test_constraints_lie_in_the_order_in_which_a_pose_graph_takes_them(joint: Session) -> None:
    local = [c for c in joint.constraints if c.kind != "loop_closure"]
    is_between = [c.from_keyframe < len(FIRST) <= c.to_keyframe for c in local]
    assert len(local) - sum(is_between) == 2 * (len(FIRST) - 1 + len(SECOND) - 1)
    assert sum(is_between) > len(SECOND) / 4
    second_keyframes = [c.to_keyframe for c in local]
    assert second_keyframes == sorted(second_keyframes)


@pytest.mark.parametrize("one_by_one", [10, 100])
def test_long_drives_are_merged_by_groups(one_by_one: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_graph, "_MOST_SOLVED_SINGLY", one_by_one)
    joint = merged(earlier_drive(), later_drive())
    assert np.abs(between(TRUE, joint.map_from_keyframe)).max() < 0.01


def test_constraints_between_bases_know_the_place_of_either_laser(joint: Session) -> None:
    bases = compose(joint.map_from_keyframe, joint.keyframe_from_base)
    np.testing.assert_allclose(bases[-1], compose(SECOND[-1], inverse(LATER_LASER)), atol=0.02)
    for c in joint.constraints_between_bases():
        error = between(c.from_pose_to_pose, between(bases[c.from_keyframe], bases[c.to_keyframe]))
        assert np.abs(error).max() < 0.02


def test_a_third_drive_carries_on_what_two_have_made() -> None:
    first, second, third = path(0.0, 16.0), path(4.0, 26.0), path(18.0, 14.0)
    both = merged(session(RING, first, IDENTITY, IDENTITY), session(RING, second, ELSEWHERE, IDENTITY))
    read = Session.from_arrays(both.to_arrays())
    joint = merged(read, session(RING, third, inverse(ELSEWHERE), IDENTITY))
    true = np.concatenate([first, second, third])
    assert np.abs(between(true, joint.map_from_keyframe)).max() < 0.02


OTHER_RING = np.concatenate([box(-7, -5, 7, 5), box(-4.5, -2, 3.5, 1.5), box(0, -5, 1, -4)])


FAR_WALLS = box(-25, -25, 25, 25)


@pytest.mark.parametrize(
    ("walls", "metres", "because"),
    [
        (
            BARE_RING,
            20.0,
            "it fits best if it begins at x .* if it begins at x .*: too alike to tell these",
        ),  # it may as well be half round
        (RING, 4.0, "its 4 m are too few to be sure"),
        (OTHER_RING, 20.0, r"it fits best if it begins at x .* m, y .* m, yaw .*, where .*% would be usual"),
        (FAR_WALLS, 20.0, "on all of its 20 m no place there fits"),
    ],
)
def test_a_place_that_is_not_recognized_is_not_merged(walls: np.ndarray, metres: float, because: str) -> None:
    earlier = session(BARE_RING, FIRST, IDENTITY, IDENTITY) if walls is BARE_RING else earlier_drive()
    second = path(11.0, metres)
    with pytest.raises(NotRecognizedError, match=f"was not recognized on the earlier map.*: {because}"):
        merged(earlier, session(walls, second, ELSEWHERE, IDENTITY))


@pytest.mark.parametrize("off", [(3.0, 0.0, 0.0), (0.0, 0.0, np.pi), (-1.0, 1.0, 0.5)])
def test_a_start_that_is_wrong_is_not_believed(off: tuple[float, float, float]) -> None:
    start = compose(compose(np.array(off), SECOND[0]), inverse(LATER_LASER))
    with pytest.raises(NotRecognizedError, match="do not fit where it was said to begin"):
        merged(earlier_drive(), later_drive(), start)


def test_either_of_the_starts_that_are_told_apart_by_nothing_can_be_stated() -> None:
    """As the sentence has them, to a tenth of a metre."""
    earlier = session(BARE_RING, FIRST, IDENTITY, IDENTITY)
    with pytest.raises(NotRecognizedError) as told:
        merged(earlier, later_drive(BARE_RING))
    number = r"(-?[\d.]+)"
    starts = re.findall(rf"begins at x {number} m, y {number} m, yaw {number}", str(told.value))
    ends = [
        merged(earlier, later_drive(BARE_RING), np.array(start, dtype=float)).map_from_keyframe[len(FIRST) :]
        for start in starts
    ]
    half_round = np.array([0.0, 0.0, np.pi])
    is_half_round = np.abs(between(SECOND[0], ends[0][0])).max() > 1.0
    for end, is_turned in zip(ends, (is_half_round, not is_half_round), strict=True):
        true = compose(half_round, SECOND) if is_turned else SECOND
        assert np.abs(between(true, end)).max() < 0.01
