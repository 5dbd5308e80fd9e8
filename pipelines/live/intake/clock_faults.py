"""What is said about the stamps of a sensor's messages."""

from collections.abc import Callable

from racecar.pipelines.bags.clocks.topic_clock import ClockReports
from racecar.pipelines.live.monitoring.faults import Faults


class ClockFaults(ClockReports):
    """Reports what a `TopicClock` finds."""

    def __init__(self, what: str, faults: Faults, other: str = "scans") -> None:
        """``what`` the messages are, and those of the ``other`` clock, in the plural."""
        self._what, self._faults, self._other = what, faults, other

    def jumped(self, seconds: float) -> None:
        """A clock was set."""
        cause = "a clock was set" if seconds > 0.0 else "a clock was set back, or a bag starts again"
        self._faults.report(
            f"{self._what}_clock",
            f"The stamps of the {self._what} jumped by {seconds:+.1f} s: {cause}. The drive goes on.",
            lasting=False,
        )

    def went_astray(self) -> None:
        """One message is left out."""
        self._faults.report(
            "lone_stamp",
            f"A stamp of the {self._what} was far from those before; the message was left out.",
            lasting=False,
        )

    def stood_still(self, is_still: bool) -> None:
        """The driver does not stamp its messages, or has stopped doing so."""
        name = f"{self._what}_stamps"
        if is_still:
            self._faults.report(
                name,
                f"The stamps of the {self._what} show no time: the messages are taken as measured when they "
                "arrive. Restart the driver, or make it stamp its messages.",
            )
        else:
            self._faults.end(name, f"The stamps of the {self._what} show the time again.")

    def disagreed(self, seconds: float) -> None:
        """The clock is another than that of the others."""
        side = "behind" if seconds > 0 else "ahead of"
        self._faults.report(
            f"{self._what}_offset",
            f"The stamps of the {self._what} were {abs(seconds):.1f} s {side} those of the {self._other}: "
            "that is corrected. Synchronize the clocks of the computers and sensors.",
            lasting=False,
        )


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
