import numpy as np
import pytest

from racecar.sensors.clocks.clock_rate import ClockRate, drift_finding

SECOND = 10**9


def clock(rate: float, delay: float, seconds: float = 60.0, seed: int = 0) -> ClockRate:
    """Whose stamps gain so much a second, of messages that are recorded with a random delay."""
    found = ClockRate()
    delays = np.random.default_rng(seed).exponential(delay, round(seconds * 50))
    for index, late in enumerate(delays.tolist()):
        time = 0.02 * index
        found.add(round((time * (1.0 + rate) + 7.0) * SECOND), round((time + late) * SECOND))
    return found


@pytest.mark.parametrize("rate", [0.02, -0.01])
@pytest.mark.parametrize("both", [0.0, -0.5])
def test_a_clock_that_runs_faster_or_slower_is_told(rate: float, both: float) -> None:
    """Also where the recording was played at another speed."""
    (finding,) = drift_finding("/odom", clock(both + rate, 0.01), "/scan", clock(both, 0.02, seed=1))
    assert finding.numbers["gains"] == ("gains" if rate > 0.0 else "loses")
    assert finding.numbers["milliseconds"] == pytest.approx(abs(rate) * 1e3, abs=0.5)


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.3])
def test_delays_are_no_drift(delay: float) -> None:
    assert drift_finding("/odom", clock(0.0, delay), "/scan", clock(0.0, 0.02, seed=1)) == []


def test_what_mapper_and_localizer_bear_is_not_told() -> None:
    assert drift_finding("/odom", clock(0.002, 0.001), "/scan", clock(0.0, 0.001, seed=1)) == []
    assert drift_finding("/odom", clock(0.1, 0.001, 0.5), "/scan", clock(0.0, 0.001, 0.5, 1)) == []
    assert drift_finding("/odom", ClockRate(), "/scan", clock(0.0, 0.01)) == []


def test_of_a_long_recording_a_part_is_enough() -> None:
    found = clock(0.01, 0.0, 600.0).drift()
    assert found is not None and found[0] == pytest.approx(0.01)
