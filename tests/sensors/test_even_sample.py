"""A bounded sample of a sequence."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.sensors.even_sample import EvenSample


@given(count=st.integers(0, 500), most=st.integers(4, 40))
def test_it_is_bounded_and_spread_evenly_from_the_first_on(count: int, most: int) -> None:
    sample = EvenSample[int](most)
    for number in range(count):
        sample.add(number)
    assert min(count, most // 2) <= len(sample.values) < most
    assert sample.values[:1] == list(range(count))[:1]
    steps = set(np.diff(sample.values).tolist())
    assert len(steps) <= 1
    assert count - (sample.values or [0])[-1] <= max(steps, default=1)
