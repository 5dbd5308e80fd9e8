"""What clicks and drags show, and how well."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.studio.outlines import arrow
from racecar.pipelines.studio.pointed import pointed

PLACE = np.array([3.0, -2.0])


def test_a_click_leaves_the_heading_open() -> None:
    shown = pointed(PLACE, PLACE + 0.1, finger=0.2)
    assert shown.heading is None
    assert shown.spread == 0.2
    np.testing.assert_array_equal(shown.pose(otherwise=1.0), [3.0, -2.0, 1.0])


@given(angle=st.floats(-3.1, 3.1), length=st.floats(0.3, 50.0))
def test_a_drag_shows_a_direction_better_the_longer_it_is(angle: float, length: float) -> None:
    ahead = np.array([math.cos(angle), math.sin(angle)])
    shown = pointed(PLACE, PLACE + length * ahead, finger=0.2)
    farther = pointed(PLACE, PLACE + 2 * length * ahead, finger=0.2)
    assert shown.heading == pytest.approx(angle)
    assert math.atan2(0.2, length) <= shown.heading_spread or shown.heading_spread == 0.1
    assert farther.heading_spread <= shown.heading_spread
    np.testing.assert_array_equal(shown.pose(otherwise=9.0), [*PLACE, shown.heading])


def test_nobody_is_taken_to_be_more_exact_than_a_decimetre() -> None:
    shown = pointed(PLACE, PLACE + 5.0, finger=0.001)
    assert (shown.spread, shown.heading_spread) == (0.1, 0.1)


@given(angle=st.floats(-3.1, 3.1), length=st.floats(0.01, 50.0), head=st.floats(0.01, 2.0))
def test_an_arrow_ends_in_two_barbs_that_are_no_longer_than_it(
    angle: float, length: float, head: float
) -> None:
    end = PLACE + length * np.array([math.cos(angle), math.sin(angle)])
    shaft, *barbs = arrow(PLACE, end, head)
    np.testing.assert_array_equal(shaft, [PLACE, end])
    for tip, back in barbs:
        np.testing.assert_array_equal(tip, end)
        assert np.hypot(*(back - tip)) == pytest.approx(min(head, length))
        assert np.dot(back - tip, PLACE - end) > 0.0
