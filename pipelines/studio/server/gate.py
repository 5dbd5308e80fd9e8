"""Who is let in to a page: whoever knows its secret address, from a browser that shows this very page.

Any web page that is open in the same browser can reach a server of this machine, and a domain of its own can
lead there as well. So the secret is asked of all; a host by another name than this machine's own, and a page
from elsewhere, are turned away before.
"""

import hmac
from collections.abc import Callable
from dataclasses import replace
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

LOOPBACK = "127.0.0.1"
_OWN_NAMES = (LOOPBACK, "localhost")
"""Of this machine; at any port, for the way here may lead through a tunnel."""
MOST_PAGES = 16
"""That are open at once: each keeps one of the server's 32 threads busy, and another while it opens."""
_HOW_TO_OPEN = "Open the page by the whole address that racecar has printed.\n"

Answer = Callable[[ServerConnection, Request], Any]


class Gate:
    """Stands before all that a server answers."""

    def __init__(self, secret: str) -> None:
        """``secret``: how the path of an address has to begin."""
        self._secret = secret

    def before(self, answer: Answer) -> Answer:
        """The same answer for those who are let in, who find everything below the secret; others get a
        sentence."""

        def answer_if_let_in(connection: ServerConnection, request: Request) -> Response | Any:
            secret, _, path = request.path.removeprefix("/").partition("/")
            if not _is_own(request) or not hmac.compare_digest(secret.encode(), self._secret.encode()):
                return connection.respond(HTTPStatus.FORBIDDEN, _HOW_TO_OPEN)
            if len(connection.server.connections) >= MOST_PAGES:
                return connection.respond(
                    HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_PAGES} pages are open already: close one.\n"
                )
            return answer(connection, replace(request, path=f"/{path}"))

        return answer_if_let_in


def _is_own(request: Request) -> bool:
    """Whether a request goes to this machine by its name and, as far as is said, comes from its page; only
    those who merely load it need not say."""
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    if len(hosts) != 1 or not _is_own_name(hosts[0]):
        return False
    return origins == [f"http://{hosts[0]}"] or (not origins and "Upgrade" not in request.headers)


def _is_own_name(host: str) -> bool:
    try:
        return urlsplit(f"//{host}").hostname in _OWN_NAMES
    except ValueError:
        return False
