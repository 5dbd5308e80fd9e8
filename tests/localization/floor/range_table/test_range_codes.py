import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.floor.range_table.range_codes import range_codes

CODES = range_codes(32.0)


@pytest.mark.parametrize("longest", [6.0, 16.0, 32.0, 60.0, 100.0])
def test_codes_fill_a_byte_in_ascending_order(longest: float) -> None:
    codes = range_codes(longest)
    assert codes.steps.shape == (256,)
    assert np.all(np.diff(codes.steps) > 0.0)
    assert codes.steps[0] == 0.0
    assert codes.longest_range == pytest.approx(longest, abs=1e-9)
    assert codes.decode(np.array([255], dtype=np.uint8))[0] == pytest.approx(longest, abs=1e-9)


@given(st.integers(0, 640))
def test_ranges_are_exact_near_by_and_never_off_by_three_steps(steps: int) -> None:
    decoded = CODES.steps[CODES.code_of_steps[steps]]
    assert abs(decoded - steps) <= (0.0 if steps <= 100 else min(0.8 + 0.004 * steps, 2.8))
    assert abs(decoded - steps) == np.abs(CODES.steps - steps).min()


@given(st.floats(0.0, 32.0))
def test_metres_come_back_as_they_were(metres: float) -> None:
    decoded = CODES.decode(CODES.encode(np.array(metres)))
    assert abs(decoded - metres) <= (0.026 if metres < 4.9 else min(0.08 + 0.004 * metres, 0.17))


def test_what_is_out_of_reach_is_the_longest_range() -> None:
    np.testing.assert_array_equal(CODES.encode(np.array([33.0, np.inf])), [255, 255])
