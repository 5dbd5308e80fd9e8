"""A thread that does what waits for it in the order it came, and survives whatever goes wrong with it."""

from collections import Counter, deque
from collections.abc import Callable
from threading import Condition, Thread

from racecar.maps.errors import UserError
from racecar.pipelines.live.monitoring.faults import Faults

Work = Callable[[], object]


class Worker:
    """Callbacks put work in and go on at once; what comes faster than it is done is dropped, oldest first."""

    def __init__(self, name: str, faults: Faults, survive: Callable[[Exception], None]) -> None:
        """What work raises goes to ``survive``, but a UserError to the ``faults``."""
        self._faults, self._survive = faults, survive
        self._waiting: dict[str, deque[tuple[int, Work]]] = {}
        self._arrivals = 0
        self._changed = Condition()
        self._is_closed = False
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self.dropped: Counter[str] = Counter()
        """By kind, what was not done because it came too fast."""

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def put(self, kind: str, work: Work, most: int = 1) -> None:
        """Let work wait for its turn; of its kind, so much may."""
        with self._changed:
            queue = self._waiting.setdefault(kind, deque())
            if len(queue) >= most:
                queue.popleft()
                self.dropped[kind] += 1
            queue.append((self._arrivals, work))
            self._arrivals += 1
            self._changed.notify()

    def backlog(self, kind: str) -> int:
        """How much of a kind is waiting."""
        with self._changed:
            return len(self._waiting.get(kind, ()))

    def clear(self, kind: str) -> int:
        """Leave out what waits of a kind; returns how much that was."""
        with self._changed:
            left_out = len(self._waiting.pop(kind, ()))
            self.dropped[kind] += left_out
            return left_out

    def finish(self, seconds: float | None = None) -> bool:
        """Do what still waits, for so long at most, and stop; whether all of it is done."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(seconds)
        return not self._thread.is_alive()

    def attempt(self, work: Work) -> None:
        """Do a piece of work by itself, so that what comes after it is done though it fails."""
        try:
            work()
        except UserError as error:
            self._faults.report("refused", str(error), lasting=False)
        except Exception as error:
            self._survive(error)

    def _run(self) -> None:
        while (work := self._next()) is not None:
            self.attempt(work)

    def _next(self) -> Work | None:
        """What came first, waiting for it; None once nothing more will come."""
        with self._changed:
            while not any(self._waiting.values()):
                if self._is_closed:
                    return None
                self._changed.wait()
            return min(filter(None, self._waiting.values()), key=lambda queue: queue[0][0]).popleft()[1]
