"""How fast the pages can draw.

A slow page must not receive more than it can show, or it would lag further and further behind.
"""

import threading
import time

from viser import ClientHandle, ViserServer

_GIVEN_UP_AFTER = 2.0
"""Seconds to wait for a page that does not answer: it may be hidden, while others are not."""
_KEY = "pulse"
"""Key requested from pages only to detect when they answer, since they process messages in order."""


class Pace:
    """Tracks which frame each page has drawn."""

    def __init__(self, server: ViserServer) -> None:
        self._server = server
        self._changed = threading.Condition()
        self.frame = 0
        """Number of frames sent."""
        self._drawn_at = 0.0
        self._reached: dict[int, int] = {}
        server.on_client_connect(self._follow)

    @property
    def has_pages(self) -> bool:
        """Whether any page is open."""
        return len(self._server.get_clients()) > 0

    @property
    def is_ready(self) -> bool:
        """Whether all pages that answer have drawn the last frame."""
        with self._changed:
            if time.monotonic() - self._drawn_at > _GIVEN_UP_AFTER:
                return True
            return all(reached >= self.frame for reached in self._reached.values())

    def note_frame(self) -> None:
        """Record that a frame was sent."""
        with self._changed:
            self.frame += 1
            self._drawn_at = time.monotonic()
            self._changed.notify_all()

    def _follow(self, client: ClientHandle) -> None:
        """Query a page after each frame, in a thread of the server, until it is closed. Between frames it is
        left alone, since each message makes it render again."""
        number, reached = client.client_id, -1
        while number in self._server.get_clients():
            with self._changed:
                self._changed.wait_for(lambda: self.frame > reached, timeout=_GIVEN_UP_AFTER)  # noqa: B023
                if self.frame == reached:
                    continue
                frame = self.frame
            try:
                client.local_storage.get_item(_KEY, timeout=_GIVEN_UP_AFTER)
            except TimeoutError:
                self._forget(number)
                continue
            except RuntimeError:
                break
            with self._changed:
                self._reached[number] = reached = frame
        self._forget(number)

    def _forget(self, number: int) -> None:
        with self._changed:
            self._reached.pop(number, None)
