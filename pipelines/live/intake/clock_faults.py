"""What is said about the stamps of a sensor's messages."""

from collections.abc import Callable

from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.clocks.topic_clock import ClockReports
from racecar.sensors.findings import Finding


class ClockFaults(ClockReports):
    """Reports what a `TopicClock` finds."""

    def __init__(self, what: str, faults: Faults, other: str = "scans") -> None:
        """``what`` the messages are, and those of the ``other`` clock, in the plural."""
        self._what, self._faults, self._other = what, faults, other

    def jumped(self, seconds: float) -> None:
        """A clock was set."""
        name = "clock_set" if seconds > 0.0 else "clock_set_back"
        finding = Finding(name, what=self._what, seconds=seconds)
        self._faults.find(finding, key=f"{self._what}_clock", lasting=False)

    def went_astray(self) -> None:
        """One message is left out."""
        self._faults.find(Finding("lone_stamp", what=self._what), lasting=False)

    def stood_still(self, is_still: bool) -> None:
        """The driver does not stamp its messages, or has stopped doing so."""
        key = f"{self._what}_stamps"
        if is_still:
            self._faults.find(Finding("stamps_show_no_time", what=self._what), key=key)
        else:
            self._faults.end(key, f"The stamps of the {self._what} show the time again.")

    def disagreed(self, seconds: float) -> None:
        """The clock is another than that of the others."""
        side, apart = "behind" if seconds > 0 else "ahead of", abs(seconds)
        finding = Finding("clocks_disagree", what=self._what, seconds=apart, side=side, other=self._other)
        self._faults.find(finding, key=f"{self._what}_offset", lasting=False)


class OdometryClockFaults(ClockFaults):
    """Names the scans' clock where that is the wrong one of the two."""

    def __init__(self, faults: Faults, scans_are_wrong: Callable[[], bool]) -> None:
        super().__init__("odometry", faults)
        self._of_scans = ClockFaults("scans", faults, other="odometry")
        self._scans_are_wrong = scans_are_wrong

    def disagreed(self, seconds: float) -> None:
        """The odometry was behind the scans, or these ahead of it."""
        if self._scans_are_wrong():
            self._of_scans.disagreed(-seconds)
        else:
            super().disagreed(seconds)
