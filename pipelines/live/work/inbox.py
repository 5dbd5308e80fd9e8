"""Work that waits for a thread in the order it came; of each kind only a number of the newest."""

from collections import Counter, deque
from collections.abc import Callable, Mapping
from threading import Condition

Work = Callable[[], object]


class Inbox:
    """Callbacks put work in and go on at once; what comes faster than it is done is dropped, oldest first."""

    def __init__(self, limits: Mapping[str, int]) -> None:
        """``limits``: of each kind, how much may wait."""
        self._limits = limits
        self._waiting: dict[str, deque[tuple[int, Work]]] = {kind: deque() for kind in limits}
        self._arrivals = 0
        self._changed = Condition()
        self._is_closed = False
        self.dropped: Counter[str] = Counter()
        """By kind, what was not done because it came too fast."""

    def put(self, kind: str, work: Work) -> None:
        """Let work wait for its turn."""
        with self._changed:
            queue = self._waiting[kind]
            if len(queue) >= self._limits[kind]:
                queue.popleft()
                self.dropped[kind] += 1
            queue.append((self._arrivals, work))
            self._arrivals += 1
            self._changed.notify()

    def get(self) -> Work | None:
        """What came first, waiting for it; None once the inbox is closed and empty."""
        with self._changed:
            while not any(self._waiting.values()):
                if self._is_closed:
                    return None
                self._changed.wait()
            first = min((queue for queue in self._waiting.values() if queue), key=lambda queue: queue[0][0])
            return first.popleft()[1]

    def backlog(self, kind: str) -> int:
        """How much of a kind is waiting."""
        with self._changed:
            return len(self._waiting[kind])

    def clear(self, kind: str) -> int:
        """Leave out what waits of a kind; returns how much that was."""
        with self._changed:
            left_out = len(self._waiting[kind])
            self._waiting[kind].clear()
            self.dropped[kind] += left_out
            return left_out

    def close(self) -> None:
        """Nothing more will come; what waits is still handed out."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
