"""A thread that does the work in an inbox, and survives whatever goes wrong with a piece of it."""

from collections.abc import Callable, Mapping
from threading import Thread

from racecar.maps.errors import UserError
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.work.inbox import Inbox, Work


class Worker:
    """Does the work that is put in, one piece after the other."""

    def __init__(
        self, name: str, limits: Mapping[str, int], faults: Faults, survive: Callable[[Exception], None]
    ) -> None:
        """``limits``: the kinds of work, and how much of each may wait. What work raises goes to ``survive``,
        but a UserError to the ``faults``."""
        self.inbox = Inbox(limits)
        self._faults = faults
        self._survive = survive
        self._thread = Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def finish(self, seconds: float | None = None) -> bool:
        """Do what still waits, for so long at most, and stop; whether all of it is done."""
        self.inbox.close()
        if self._thread.is_alive():
            self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (work := self.inbox.get()) is not None:
            self.attempt(work)

    def attempt(self, work: Work) -> None:
        """Do a piece of work by itself, so that what comes after it is done though it fails."""
        try:
            work()
        except UserError as error:
            self._faults.report("refused", str(error), lasting=False)
        except Exception as error:
            self._survive(error)
