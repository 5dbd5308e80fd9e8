"""Two moments are chosen by doubts, clicks and times, and the second pass is moved onto the first."""

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Moment,
    NotSamePlace,
    SamePlace,
    points_of,
)
from racecar.mapping.mending.mender import Mender
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between, compose
from racecar.pipelines.studio.mend.described import described
from racecar.pipelines.studio.mend.passes import Passes
from racecar.pipelines.studio.mend.wall_points import as_at_first
from tests.mapping.mending.test_mender import TRUE
from tests.pipelines.studio.mending import unclosed, wrongly_closed

LAP = 107
"""Keyframes of a lap, and seconds."""


@pytest.fixture(scope="module")
def session() -> Session:
    return unclosed()


@pytest.fixture
def passes(session: Session) -> Passes:
    return Passes(session)


def test_a_doubt_leads_to_two_passes_of_one_place(session: Session, passes: Passes) -> None:
    poses = session.map_from_keyframe
    doubts = [
        doubt
        for doubt in judge(FinishedMap(session), MappingConfig().quality).segments
        if doubt.contradicted_by is not None
    ]
    assert doubts
    for doubt in doubts:
        first, second = passes.pair_of(doubt, poses)
        assert abs(second - first - LAP) < 10
        assert passes.name_of(doubt, poses) == f"{first}.0 s and {second}.0 s"


def test_clicks_choose_two_passes_and_then_begin_again(session: Session, passes: Passes) -> None:
    poses = session.map_from_keyframe
    for _ in range(2):
        passes.choose_place(poses[20, :2], poses)
        assert (passes.first, passes.second) == (20, None)
        passes.choose_place(poses[20, :2], poses)
        assert passes.first == 20
        assert passes.second is not None and abs(passes.second - 20 - LAP) < 10


def test_constraints_name_the_chosen_moments(session: Session, passes: Passes) -> None:
    for make in (passes.not_same_place, lambda: passes.same_place(session.map_from_keyframe)):
        with pytest.raises(UserError, match="Choose two moments first"):
            make()
    passes.choose_moment(Moment(30.2), is_second=True)
    passes.choose_moment(Moment(12.0), is_second=False)
    twelve, thirty = Moment(12.0), Moment(30.0)
    assert passes.not_same_place() == NotSamePlace(twelve, thirty)
    assert passes.same_place(session.map_from_keyframe) == SamePlace(twelve, thirty)
    assert passes.distrust("scans") == Distrust("scans", twelve, thirty)
    with pytest.raises(RefusedConstraintError, match=r"no moment 999\.0 s"):
        passes.choose_moment(Moment(999.0), is_second=True)


def test_a_pass_that_is_dragged_where_it_belongs_is_refined_there(session: Session, passes: Passes) -> None:
    poses, (first, second) = session.map_from_keyframe, (20, 20 + LAP)
    passes.choose(first, second)
    where = between(TRUE[first], TRUE[second])
    passes.moved[:] = compose(poses[first], where) - poses[second] + np.array([0.2, -0.1, 0.05])
    constraint = passes.same_place(poses)
    assert constraint.first_from_second is not None
    np.testing.assert_allclose(constraint.first_from_second[:2], where[:2], atol=0.3)
    seen, moved = passes.points(poses, passes.moved)
    assert len(seen) > 100
    nearest = np.array([np.hypot(*(seen - point).T).min() for point in moved])
    assert np.median(nearest) < 0.3
    mender = Mender(session)
    mender.add(constraint)
    corrected = mender.session().map_from_keyframe
    np.testing.assert_allclose(between(corrected[first], corrected[second]), where, atol=0.05)


def test_points_of_walls_are_named_in_the_map_that_is_saved() -> None:
    session = wrongly_closed()
    mender = Mender(session)
    mender.add(NotSamePlace(Moment(16.0), Moment(86.0)))
    shown, first = mender.session().map_from_keyframe, session.map_from_keyframe
    named = Distance(((-6.0, 0.0), (6.0, 0.0)), 12.0)
    carried = as_at_first(named, session.keyframes, shown, first)
    before, after = points_of(named), points_of(carried)
    assert before is not None and after is not None
    assert np.abs(after - before).max() > 0.5
    again = points_of(as_at_first(carried, session.keyframes, first, shown))
    np.testing.assert_allclose(again, before, atol=0.05)
    with pytest.raises(RefusedConstraintError, match="no scan saw a wall"):
        as_at_first(Distance(((0.0, -3.0), (6.0, 0.0)), 6.0), session.keyframes, shown, first)


def test_a_list_says_what_constraints_state() -> None:
    assert described(SamePlace(Moment(1.0), Moment(95.04))) == "same place: 1.0 s and 95.0 s"
    assert described(NotSamePlace(Moment(1.0, 0), Moment(9.0, 1))) == (
        "not the same place: drive 1, 1.0 s and drive 2, 9.0 s"
    )
    assert described(Distance(((0.0, 0.0), (1.0, 0.0)), 1.02)) == "distance: 1.02 m"
    assert described(Distrust("wheels", Moment(1.0), Moment(2.0))) == "wheels distrusted: 1.0 s to 2.0 s"
