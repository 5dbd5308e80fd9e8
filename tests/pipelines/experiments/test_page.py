"""Axes of the experiments' figures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from racecar.pipelines.experiments.page import show_plain_ticks


@given(low=st.floats(-4.0, 4.0), decades=st.floats(0.36, 6.0))
def test_a_logarithmic_axis_has_several_numbers(low: float, decades: float) -> None:
    axes = Figure().subplots()
    axes.set(yscale="log", ylim=(10.0**low, 10.0 ** (low + decades)))
    show_plain_ticks(axes.yaxis)
    first, last = axes.get_ylim()
    shown = [tick for tick in np.asarray(axes.get_yticks()) if first <= tick <= last]
    assert 2 <= len(shown) <= 8


@pytest.mark.parametrize(("value", "words"), [(0.1, "0.1"), (1000.0, "1000"), (20.0, "20")])
def test_numbers_are_written_in_full(value: float, words: str) -> None:
    axes = Figure().subplots()
    axes.set(yscale="log", ylim=(value / 2, value * 2))
    show_plain_ticks(axes.yaxis)
    assert axes.yaxis.get_major_formatter()(value) == words
