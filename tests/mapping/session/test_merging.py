"""A drive is joined to an earlier map where it was found, if it really lies there, or it is said why not."""

from collections.abc import Iterator
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


ROUGHLY = np.array([0.15, -0.1, 0.02])
"""By how much the place is wrong that is found."""


def merged(
    earlier: Session,
    later: Session,
    at: Pose,
    *,
    is_start_given: bool = False,
) -> Session:
    """Both, when the later drive is found at (K, 3) on the earlier map."""

    def find(session: Session) -> Iterator[Pose | None]:
        assert session is later
        for k, pose in enumerate(at):
            yield None if k < 3 else compose(pose, ROUGHLY)

    map_ = EarlierMap(earlier, find, is_start_given=is_start_given)
    return merge(map_, later)


FIRST, SECOND = path(0.0, 34.0), path(11.0, 20.0)
TRUE = np.concatenate([FIRST, SECOND])


@cache
def earlier_drive() -> Session:
    return session(RING, FIRST, IDENTITY, EARLIER_LASER)


def later_drive(walls: np.ndarray = RING) -> Session:
    return session(walls, SECOND, ELSEWHERE, LATER_LASER)


@pytest.fixture(scope="module")
def joint() -> Session:
    """What both drives make."""
    return merged(earlier_drive(), later_drive(), SECOND)


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
    joint = merged(earlier_drive(), later_drive(), SECOND)
    assert np.abs(between(TRUE, joint.map_from_keyframe)).max() < 0.01


def test_constraints_between_bases_know_the_place_of_either_laser(joint: Session) -> None:
    bases = compose(joint.map_from_keyframe, joint.keyframe_from_base)
    np.testing.assert_allclose(bases[-1], compose(SECOND[-1], inverse(LATER_LASER)), atol=0.02)
    for c in joint.constraints_between_bases():
        error = between(c.from_pose_to_pose, between(bases[c.from_keyframe], bases[c.to_keyframe]))
        assert np.abs(error).max() < 0.02


def test_a_third_drive_carries_on_what_two_have_made() -> None:
    first, second, third = path(0.0, 16.0), path(4.0, 26.0), path(18.0, 14.0)
    both = merged(
        session(RING, first, IDENTITY, IDENTITY), session(RING, second, ELSEWHERE, IDENTITY), second
    )
    read = Session.from_arrays(both.to_arrays())
    joint = merged(read, session(RING, third, inverse(ELSEWHERE), IDENTITY), third)
    true = np.concatenate([first, second, third])
    assert np.abs(between(true, joint.map_from_keyframe)).max() < 0.02


OTHER_RING = np.concatenate([box(-7, -5, 7, 5), box(-4.5, -2, 3.5, 1.5), box(0, -5, 1, -4)])


@pytest.mark.parametrize(
    ("walls", "metres", "because"),
    [
        (BARE_RING, 20.0, "as well as at"),  # it may as well be half round
        (RING, 5.0, "too few to be sure"),
        (OTHER_RING, 20.0, "contradict"),
    ],
)
def test_a_place_that_is_not_recognized_is_not_merged(walls: np.ndarray, metres: float, because: str) -> None:
    earlier = session(BARE_RING, FIRST, IDENTITY, IDENTITY) if walls is BARE_RING else earlier_drive()
    second = path(11.0, metres)
    with pytest.raises(NotRecognizedError, match=f"not recognized on the earlier map: .*{because}"):
        merged(earlier, session(walls, second, ELSEWHERE, IDENTITY), second)


@pytest.mark.parametrize("off", [(3.0, 0.0, 0.0), (0.0, 0.0, np.pi), (-1.0, 1.0, 0.5)])
def test_a_place_that_is_wrong_is_not_believed(off: tuple[float, float, float]) -> None:
    with pytest.raises(NotRecognizedError):
        merged(earlier_drive(), later_drive(), compose(np.array(off), SECOND))


def test_a_drive_that_is_found_nowhere_says_so() -> None:
    with pytest.raises(NotRecognizedError, match="on all of its 20 m no place there fits"):
        merged(earlier_drive(), later_drive(), np.zeros((0, 3)))


def test_a_start_that_is_given_tells_places_apart_that_look_alike() -> None:
    earlier = session(BARE_RING, FIRST, IDENTITY, IDENTITY)
    joint = merged(earlier, later_drive(BARE_RING), SECOND, is_start_given=True)
    assert np.abs(between(TRUE, joint.map_from_keyframe)).max() < 0.01
