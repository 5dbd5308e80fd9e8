import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, CODE_OF_CELLS, FARTHEST


def test_codes_fill_a_byte_in_ascending_order() -> None:
    assert CELLS_OF_CODE.shape == (256,)
    assert np.all(np.diff(CELLS_OF_CODE) > 0.0)
    assert CELLS_OF_CODE[0] == 0.0
    assert CELLS_OF_CODE[-1] == FARTHEST


@given(st.integers(0, FARTHEST))
def test_ranges_are_exact_near_by_and_never_off_by_three_cells(cells: int) -> None:
    told = CELLS_OF_CODE[CODE_OF_CELLS[cells]]
    assert abs(told - cells) <= (0.0 if cells <= 100 else min(0.8 + 0.004 * cells, 2.8))
    assert abs(told - cells) == np.abs(CELLS_OF_CODE - cells).min()
