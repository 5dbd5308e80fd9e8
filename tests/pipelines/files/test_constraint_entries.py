import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Here,
    ManualConstraint,
    Moment,
    NotSamePlace,
    RightAngle,
    SamePlace,
    Straight,
    moved,
)
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import inverse
from racecar.pipelines.files.constraint_entries import CONSTRAINT_KINDS, constraint_of, text_of_constraint

METRES = st.floats(-1e3, 1e3).map(lambda x: x + 0.0)
PLACES = st.tuples(METRES, METRES)
MOMENTS = st.builds(Moment, st.floats(0.0, 1e4), st.none() | st.integers(0, 3))
PAIRS = st.tuples(MOMENTS, MOMENTS).map(
    lambda pair: pair if (pair[0].recording is None) == (pair[1].recording is None) else (pair[0], pair[0])
)
POSES = st.tuples(METRES, METRES, st.floats(-3.0, 3.0))
TWO_PLACES = st.tuples(PLACES, PLACES).filter(lambda pair: pair[0] != pair[1])
ANGLES = st.floats(-3.0, 3.0)
CONSTRAINTS = st.one_of(
    PAIRS.map(lambda pair: NotSamePlace(*pair)),
    st.builds(
        lambda pair, pose: SamePlace(*pair, pose), PAIRS, st.none() | st.tuples(METRES, METRES, ANGLES)
    ),
    st.builds(Distance, TWO_PLACES, st.floats(0.01, 1e4)),
    st.builds(Straight, TWO_PLACES),
    st.builds(RightAngle, TWO_PLACES),
    st.builds(Here, MOMENTS, PLACES, st.none() | ANGLES),
    st.builds(lambda source, pair: Distrust(source, *pair), st.sampled_from(["wheels", "scans"]), PAIRS),
)


def read(text: str) -> ManualConstraint:
    (entry,) = yaml.safe_load(text)
    (kind,) = [kind for kind in CONSTRAINT_KINDS if kind in entry]
    return constraint_of(entry, kind, "Edit 1")


def numbers(constraint: ManualConstraint) -> list[float]:
    (entry,) = yaml.safe_load(text_of_constraint(constraint))
    values = [value for value in entry.values() if value not in ("wheels", "scans")]
    return [float(x) for value in values for x in np.ravel(value)]


@given(CONSTRAINTS)
def test_what_was_written_is_read(constraint: ManualConstraint) -> None:
    again = read(text_of_constraint(constraint))
    assert type(again) is type(constraint)
    np.testing.assert_allclose(numbers(again), numbers(constraint), rtol=1e-12, atol=1e-12)


@given(CONSTRAINTS, st.tuples(METRES, METRES, ANGLES))
def test_in_another_frame_and_back_it_is_the_same(
    constraint: ManualConstraint, frame: tuple[float, float, float]
) -> None:
    there = moved(constraint, np.array(frame))
    back = moved(there, inverse(np.array(frame)))
    apart = np.array(numbers(back)) - np.array(numbers(constraint))
    assert np.abs((apart + 180.0) % 360.0 - 180.0).max(initial=0.0) < 1e-6


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("- same_place: [1.0]", "two moments in seconds"),
        ("- same_place: [1.0, here]", "moments in seconds since the recording began"),
        ("- same_place: [1.0, 2.0]\n  poes: [0, 0, 0]", "did you mean 'pose'"),
        ("- same_place: [1.0, 2.0]\n  pose: [0, 0]", r"pose should be \[x, y, yaw\]"),
        ("- not_same_place: [1.0, 2.0]\n  recordings: [1]", "a list of 2"),
        ("- not_same_place: [1.0, 2.0]\n  recordings: [0, 1]", "numbered from 1 on"),
        ("- distance: [[0, 0], [1, 0]]", "metres is missing"),
        ("- distance: [[0, 0], [1, 0]]\n  metres: -2", "metres is -2"),
        ("- straight: [[0, 0], [0, 0]]", "two points of walls that differ"),
        ("- right_angle: [[0, 0]]", "two points of walls that differ"),
        ("- here: 3.0", r"pose should be \[x, y\]"),
        ("- here: [3.0]\n  pose: [0, 0]", "moments in seconds"),
        ("- distrust: [1.0, 2.0]\n  source: laser", "source should be wheels or scans"),
        ("- distrust: [1.0, .inf]\n  source: wheels", "moments in seconds"),
        (f"- same_place: [1.0, {'9' * 400}]", "moments in seconds"),
        (f"- distance: [[0, 0], [1, 0]]\n  metres: {'9' * 400}", "metres is 999.*at most"),
        ("- straight: [[0, 0], [1, 0]]\n  metres: 2", "unknown key 'metres'; known are straight"),
    ],
)
def test_a_mistake_is_explained(text: str, why: str) -> None:
    with pytest.raises(UserError, match=why):
        read(text)
