"""The path is settled when one more round of matching bends it no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.keyframes.final_optimization import mean_bend
from racecar.maps.geometry.se2 import Pose, compose

LINE = np.column_stack([np.arange(50) * 0.3, np.zeros((50, 2))])
poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.0, 3.0)).map(np.array)


@given(poses)
def test_a_path_that_moves_as_a_whole_is_not_bent(map_from_line: Pose) -> None:
    assert mean_bend(LINE, compose(map_from_line, LINE), 30) < 1e-9


@given(st.floats(-0.2, 0.2))
def test_a_path_that_grows_is_bent_by_as_much_over_so_many_keyframes(share: float) -> None:
    assert mean_bend(LINE, LINE * [1.0 + share, 1.0, 1.0], 30) == pytest.approx(abs(share) * 9.0)


def test_a_path_of_few_keyframes_is_bent_as_its_ends_are() -> None:
    assert mean_bend(LINE[:3], LINE[:3] * [1.5, 1.0, 1.0], 30) == pytest.approx(0.3)
