"""A thread that processes a queue in order of arrival, and survives exceptions."""

from collections import Counter, deque
from collections.abc import Callable
from threading import Condition, Thread

from racecar.maps.errors import UserError
from racecar.pipelines.live.monitoring.faults import Faults

Work = Callable[[], object]


class Worker:
    """Callbacks enqueue work and return at once; if it arrives too fast, the oldest is dropped."""

    def __init__(self, name: str, faults: Faults, survive: Callable[[Exception], None]) -> None:
        """Exceptions of work go to ``survive``, except UserError, which goes to ``faults``."""
        self._faults, self._survive = faults, survive
        self._waiting: dict[str, deque[tuple[int, Work]]] = {}
        self._arrivals = 0
        self._changed = Condition()
        self._is_closed = False
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self.dropped: Counter[str] = Counter()
        """Number of dropped pieces of work by kind."""

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def put(self, kind: str, work: Work, most: int = 1) -> None:
        """Enqueue work, at most ``most`` pieces of its kind."""
        with self._changed:
            queue = self._waiting.setdefault(kind, deque())
            if len(queue) >= most:
                queue.popleft()
                self.dropped[kind] += 1
            queue.append((self._arrivals, work))
            self._arrivals += 1
            self._changed.notify()

    def backlog(self, kind: str) -> int:
        """Number of waiting pieces of a kind."""
        with self._changed:
            return len(self._waiting.get(kind, ()))

    def clear(self, kind: str) -> int:
        """Drop the waiting work of a kind; returns the number of pieces."""
        with self._changed:
            left_out = len(self._waiting.pop(kind, ()))
            self.dropped[kind] += left_out
            return left_out

    def finish(self, seconds: float | None = None) -> bool:
        """Finish waiting work, within ``seconds`` if given, and stop; returns whether all of it is done."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(seconds)
        return not self._thread.is_alive()

    def attempt(self, work: Work) -> None:
        """Do a piece of work; if it fails, the error is reported and the work after it still runs."""
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
        """The oldest work, waiting for it; None once there will be no more."""
        with self._changed:
            while not any(self._waiting.values()):
                if self._is_closed:
                    return None
                self._changed.wait()
            return min(filter(None, self._waiting.values()), key=lambda queue: queue[0][0]).popleft()[1]
