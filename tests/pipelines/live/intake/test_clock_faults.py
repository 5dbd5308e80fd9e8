"""What is said of stamps that jump."""

import pytest

from racecar.pipelines.live.intake.clock_faults import ClockFaults
from racecar.pipelines.live.monitoring.faults import Faults


@pytest.mark.parametrize(
    ("seconds", "cause"),
    [(3.0, "a clock was set."), (-90.0, "a clock was set back, or a bag starts again.")],
)
def test_stamps_go_back_where_a_bag_is_played_in_a_loop_too(seconds: float, cause: str) -> None:
    log: list[str] = []
    ClockFaults("scans", Faults(log.append, log.append)).jumped(seconds)
    assert log == [f"The stamps of the scans jumped by {seconds:+.1f} s: {cause} The drive goes on."]
