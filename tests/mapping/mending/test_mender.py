import math
from dataclasses import replace

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Here,
    Moment,
    NotSamePlace,
    RightAngle,
    SamePlace,
    Straight,
)
from racecar.mapping.mending.mender import Mender
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, between, compose
from tests.mapping.mending.bent import bent, error, two_laps
from tests.mapping.sessions import path
from tests.sensors.worlds import CORRIDOR, box

TRUE = path(0.0, 60.0)
LAP = 32.0 / 0.3
"""Seconds of a lap round the block, a keyframe a second."""
HALL = box(-1.0, -1.5, 31.0, 1.5)
ALONG_HALL = np.column_stack([np.arange(0.0, 30.0, 0.3), np.zeros(100), np.zeros(100)])


def apart(session: Session) -> float:
    """Metres by which the second lap lies off the first one at most."""
    later = round(LAP)
    seen, right = (between(poses[:-later], poses[later:]) for poses in (session.map_from_keyframe, TRUE))
    return float(np.hypot(*(seen - right)[:, :2].T).max())


def moments(first: float, second: float) -> tuple[Moment, Moment]:
    return Moment(first), Moment(second)


@pytest.mark.parametrize("given", [None, (0.2, 0.1, 0.05)])
def test_two_moments_at_one_place_bring_two_laps_onto_each_other(
    given: tuple[float, float, float] | None,
) -> None:
    mender = Mender(two_laps())
    effect = mender.add(SamePlace(*moments(5.0, round(5.0 + LAP)), given))
    assert apart(two_laps()) > 1.0
    assert apart(mender.session()) < 0.05
    assert error(mender.session(), TRUE) < 0.2 * error(two_laps(), TRUE)
    assert effect.farthest > 0.3
    assert f"{effect.farthest:.2f} m" in effect.summary


@pytest.mark.parametrize(
    ("constraint", "why"),
    [
        (SamePlace(*moments(30.0, 60.0)), "30.0 s and 60.0 s they look through"),
        (SamePlace(*moments(5.0, 5.2)), "one keyframe"),
        (SamePlace(*moments(5.0, 500.0)), "no moment 500.0 s"),
        (SamePlace(Moment(5.0, 1), Moment(9.0, 1)), "no recording 2"),
        (NotSamePlace(*moments(5.0, 112.0)), "Nothing ties 5.0 s to 112.0 s"),
        (Distrust("wheels", *moments(9.0, 5.0)), "in this order"),
        (Distance(((0.0, 0.0), (1.0, 0.0)), 3.0), "no scan saw a wall"),
        (Straight(((0.0, 0.0), (1.0, 0.0))), "no scan saw a wall"),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(constraint: object, why: str) -> None:
    mender = Mender(two_laps())
    with pytest.raises(RefusedConstraintError, match=why):
        mender.add(constraint)  # type: ignore[arg-type]
    np.testing.assert_array_equal(mender.session().map_from_keyframe, two_laps().map_from_keyframe)


def test_along_bare_walls_only_a_given_pose_says_where_both_moments_lie() -> None:
    corridor = bent(ALONG_HALL, scale=1.03, walls=CORRIDOR)
    mender = Mender(corridor)
    with pytest.raises(RefusedConstraintError, match="do not show where along them"):
        mender.add(SamePlace(*moments(10.0, 14.0)))
    mender.add(SamePlace(*moments(10.0, 90.0), (23.0, 0.0, 0.0)))
    before, after = (
        float(between(*each.map_from_keyframe[[10, 90]])[0]) for each in (corridor, mender.session())
    )
    assert before > 24.6
    assert 23.0 < after < 24.5  # scans and wheels count, too


def with_wrong_loop(session: Session, first: int, second: int) -> Session:
    """Bent as if both keyframes were at one place."""
    loops = [
        Constraint(first + k, second + k, IDENTITY, np.eye(3) * 1e7, "loop_closure") for k in range(0, 9, 3)
    ]
    known = sorted([*session.constraints, *loops], key=lambda each: each.to_keyframe)
    graph = PoseGraph(known)
    poses = PoseGraph(
        [replace(each, kind="manual") if each.kind == "loop_closure" else each for each in known]
    ).optimize(session.map_from_keyframe)
    return replace(session, map_from_keyframe=poses, constraints=graph.constraints)


def test_a_loop_between_two_places_is_cut_and_not_found_again() -> None:
    wrong = with_wrong_loop(two_laps(turn=0.0), 10, 80)
    assert error(wrong, TRUE) > 0.5
    mender = Mender(wrong)
    effect = mender.add(NotSamePlace(*moments(10.0, 80.0)))
    corrected = mender.session()
    assert effect.cut == 3
    ends = corrected.constraints.ends
    assert not ((np.abs(ends[:, 0] - 10) < 10) & (np.abs(ends[:, 1] - 80) < 10)).any()
    assert error(corrected, TRUE) < 0.05


def test_a_distance_between_walls_corrects_a_scale() -> None:
    with_pillar = np.concatenate([HALL, box(1.0, 0.5, 1.4, 1.5)])
    long = bent(ALONG_HALL, scale=1.03, walls=with_pillar)
    pillar, end = (1.0, 1.0), (float(long.map_from_keyframe[-1, 0]) + 31.0 - 29.7, 1.0)
    mender = Mender(long)
    mender.add(Distance((pillar, end), 30.0))
    assert abs(long.map_from_keyframe[-1, 0] - 29.7) > 0.8
    assert abs(mender.session().map_from_keyframe[-1, 0] - 29.7) < 0.05


def test_a_straight_wall_unbends_a_corridor() -> None:
    curved = bent(ALONG_HALL, turn=0.002, walls=HALL)
    ends = [compose(curved.map_from_keyframe[k], np.array([0.0, 1.5, 0.0]))[:2] for k in (2, 97)]
    (a, b), (c, d) = (end.tolist() for end in ends)
    mender = Mender(curved)
    mender.add(Straight(((a, b), (c, d))))
    straight = mender.session().map_from_keyframe
    assert np.ptp(curved.map_from_keyframe[10:84, 2]) > 0.1
    assert np.ptp(straight[10:84, 2]) < 0.01


def test_a_right_angle_turns_what_lies_between_two_walls() -> None:
    corner = path(0.0, 13.0)  # along two sides of the block
    turned = bent(corner, turn=0.003)
    wall_of = {k: compose(turned.map_from_keyframe[k], np.array([0.0, -1.0, 0.0]))[:2] for k in (3, 42)}
    first, second = (tuple(wall_of[k].tolist()) for k in (3, 42))
    off = between(corner[3], corner[42])[2] - between(*turned.map_from_keyframe[[3, 42]])[2]
    mender = Mender(turned)
    mender.add(RightAngle((first, second)))
    left = between(corner[3], corner[42])[2] - between(*mender.session().map_from_keyframe[[3, 42]])[2]
    assert abs(off) > 0.1
    assert abs(left) < 0.02


@pytest.mark.parametrize("yaw", [True, False])
def test_places_on_a_plan_give_the_map_its_frame_and_shape(*, yaw: bool) -> None:
    plan_from_world = np.array([20.0, -5.0, math.radians(30.0)])
    on_plan = compose(plan_from_world, TRUE)
    mender = Mender(two_laps())
    for k in (0, 40, 80, 120, 160, 199):
        x, y, heading = on_plan[k].tolist()
        mender.add(Here(Moment(float(k)), (x, y), heading if yaw else None))
    corrected = mender.session()
    assert error(corrected, on_plan) < 0.1
    assert corrected.constraints.ends.max() < len(TRUE)
    assert corrected.constraints.are("manual").sum() == 5


def test_one_place_on_a_plan_moves_the_map_as_it_is() -> None:
    x, y, heading = 7.0, 8.0, 1.0
    mender = Mender(two_laps())
    mender.add(Here(Moment(10.0), (x, y), heading))
    corrected = mender.session().map_from_keyframe
    np.testing.assert_allclose(corrected[10], [x, y, heading], atol=1e-3)
    shape = between(*two_laps().map_from_keyframe[[0, 150]])
    np.testing.assert_allclose(between(*corrected[[0, 150]]), shape, atol=1e-3)


def test_wheels_that_are_distrusted_do_not_pull() -> None:
    session = two_laps(turn=0.0)
    slipped = [
        Constraint(k, k + 1, np.array([0.9, 0.0, 0.0]), np.eye(3) * 1e6, "odometry") for k in range(50, 60)
    ]
    known = sorted([*session.constraints, *slipped], key=lambda each: each.to_keyframe)
    poses = PoseGraph(known).optimize(session.map_from_keyframe)
    pulled = replace(session, map_from_keyframe=poses, constraints=ConstraintList(known))
    mender = Mender(pulled)
    mender.add(Distrust("wheels", *moments(50.0, 60.0)))
    assert error(pulled, TRUE) > 1.0
    assert error(mender.session(), TRUE) < 0.05


def test_scans_that_are_distrusted_leave_the_path_in_one_piece() -> None:
    session = two_laps(turn=0.0)
    mender = Mender(session)
    effect = mender.add(Distrust("scans", *moments(50.0, 60.0)))
    corrected = mender.session()
    touched = np.isin(session.constraints.ends, np.arange(50, 61)).any(axis=1)
    assert effect.cut == touched.sum()
    assert error(corrected, TRUE) < 0.05
    assert not np.isin(
        np.arange(50, 61),
        corrected.constraints.chosen(np.flatnonzero(corrected.constraints.are("scan_matching"))).ends,
    ).any()


def test_a_drive_too_short_for_loops_is_corrected() -> None:
    short = bent(path(0.0, 2.0), turn=0.05)
    mender = Mender(short)
    x, y, yaw = TRUE[6].tolist()
    mender.add(Here(Moment(0.0), (-5.0, -3.0), 0.0))
    mender.add(Here(Moment(6.0), (x, y), yaw))
    assert abs(mender.session().map_from_keyframe[6, 2] - yaw) < 0.5 * abs(
        short.map_from_keyframe[6, 2] - yaw
    )


def test_what_is_taken_back_leaves_no_trace() -> None:
    mender = Mender(two_laps())
    mender.add(SamePlace(*moments(5.0, 112.0)))
    mender.undo()
    assert mender.session().measured is None
    np.testing.assert_array_equal(mender.session().map_from_keyframe, two_laps().map_from_keyframe)


def test_a_corrected_session_is_corrected_from_what_was_measured() -> None:
    first = Mender(two_laps())
    first.add(SamePlace(*moments(5.0, 112.0)))
    again = Mender(first.session())
    np.testing.assert_array_equal(again.session().map_from_keyframe, two_laps().map_from_keyframe)
    again.add(SamePlace(*moments(5.0, 112.0)))
    np.testing.assert_array_equal(again.session().map_from_keyframe, first.session().map_from_keyframe)


def test_the_file_of_a_corrected_session_holds_what_was_measured() -> None:
    mender = Mender(two_laps())
    mender.add(SamePlace(*moments(5.0, 112.0)))
    read = Session.from_arrays(mender.session().to_arrays())
    assert read.constraints.are("manual").sum() == 1
    assert read.measured is not None
    np.testing.assert_array_equal(read.as_measured.map_from_keyframe, two_laps().map_from_keyframe)
    assert len(read.as_measured.constraints) == len(two_laps().constraints)
