"""Report faults in the stamps of a sensor's messages."""

from collections.abc import Callable

from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.clocks.topic_clock import ClockReports
from racecar.sensors.findings import Finding


class ClockFaults(ClockReports):
    """Reports what a `TopicClock` finds."""

    def __init__(
        self,
        what: str,
        faults: Faults,
        other: str = "scans",
        is_other_wrong: Callable[[], bool] = lambda: False,
    ) -> None:
        """``what`` and ``other`` name the messages of the two clocks, in the plural; ``is_other_wrong``:
        whether the other clock is wrong if the two disagree."""
        self._what, self._faults, self._other, self._is_other_wrong = what, faults, other, is_other_wrong

    def jumped(self, seconds: float) -> None:
        """The clock was set."""
        name = "clock_set" if seconds > 0.0 else "clock_set_back"
        finding = Finding(name, what=self._what, seconds=seconds)
        self._faults.find(finding, key=f"{self._what}_clock", lasting=False)

    def went_astray(self) -> None:
        """A single message is dropped."""
        self._faults.find(Finding("lone_stamp", what=self._what), lasting=False)

    def stood_still(self, is_still: bool) -> None:
        """The driver does not stamp its messages, or does so again."""
        finding = Finding("stamps_show_no_time", what=self._what)
        ended = f"The stamps of the {self._what} show the time again."
        self._faults.judge(is_still, finding, ended, key=f"{self._what}_stamps")

    def disagreed(self, seconds: float) -> None:
        """The clock differs from the other one."""
        what, other = self._what, self._other
        if self._is_other_wrong():
            what, other, seconds = other, what, -seconds
        side, apart = "behind" if seconds > 0 else "ahead of", abs(seconds)
        finding = Finding("clocks_disagree", what=what, seconds=apart, side=side, other=other)
        self._faults.find(finding, key=f"{what}_offset", lasting=False)
