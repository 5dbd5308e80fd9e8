"""What a slow logger keeps."""

import numpy as np
import pytest

from racecar.pipelines.simulation.driver import TICK
from racecar.pipelines.simulation.simulator import kept_ticks

FAST = np.arange(0, 12_000, 5)
"""A minute at 40 Hz."""


def test_without_faults_every_sweep_is_kept() -> None:
    np.testing.assert_array_equal(kept_ticks(FAST, 0.0, 0.0), FAST)


@pytest.mark.parametrize("every", [1.0, 2.0, 3.0])
def test_one_sweep_is_kept_in_a_time(every: float) -> None:
    seconds = TICK * kept_ticks(FAST, every, 0.0)
    np.testing.assert_allclose(np.diff(seconds), every)
    assert len(seconds) == pytest.approx(60.0 / every, abs=1)


def test_a_laser_that_is_slower_than_the_logger_keeps_its_rate() -> None:
    np.testing.assert_array_equal(kept_ticks(FAST[::40], 0.5, 0.0), FAST[::40])


def test_gaps_end_each_quarter_of_a_minute() -> None:
    seconds = TICK * kept_ticks(FAST, 0.0, 3.0)
    assert np.all(seconds % 15.0 < 12.0)
    assert np.count_nonzero(np.diff(seconds) > 2.9) == 3
    assert len(seconds) == pytest.approx(0.8 * len(FAST), abs=5)
