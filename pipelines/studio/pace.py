"""How fast the pages can draw.

A slow page must not be sent more than it can show, or it would fall ever further behind and answer clicks
late.
"""

import threading
import time

from viser import ClientHandle, ViserServer

_GIVEN_UP_AFTER = 2.0
"""Seconds for which a page that does not answer is waited for: it may be hidden, and others are not."""
_KEY = "pulse"
"""What pages are asked for, only to see when they answer: they take messages one after the other."""


class Pace:
    """Knows which frame each page has come to."""

    def __init__(self, server: ViserServer) -> None:
        self._server = server
        self._changed = threading.Condition()
        self.frame = 0
        """How many were sent."""
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
        """A frame was sent."""
        with self._changed:
            self.frame += 1
            self._drawn_at = time.monotonic()
            self._changed.notify_all()

    def _follow(self, client: ClientHandle) -> None:
        """Ask a page after each frame, in a thread of the server's own, until it is closed."""
        number = client.client_id
        while number in self._server.get_clients():
            with self._changed:
                frame = self.frame
            try:
                client.local_storage.get_item(_KEY, timeout=_GIVEN_UP_AFTER)
            except TimeoutError:
                self._forget(number)
                continue
            except RuntimeError:
                break
            with self._changed:
                self._reached[number] = frame
                self._changed.wait_for(lambda: self.frame > frame, timeout=_GIVEN_UP_AFTER)  # noqa: B023
        self._forget(number)

    def _forget(self, number: int) -> None:
        with self._changed:
            self._reached.pop(number, None)
