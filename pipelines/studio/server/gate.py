"""Access to a page: only with its secret address, and from a browser that shows this very page.

Any web page open in the same browser can send requests to a server on this machine, and its own domain may
resolve there too. Therefore every request needs the secret. Requests for another host name than this
machine's own, and those from other pages, are rejected first.
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
"""Names of this machine; any port is accepted, since requests may come through a tunnel."""
MOST_PAGES = 16
"""Maximum open pages: each keeps one of the server's 32 threads busy, and another while it opens."""
_HOW_TO_OPEN = "Open the page by the whole address that racecar has printed.\n"

Answer = Callable[[ServerConnection, Request], Any]


class Gate:
    """Checks every request before the server answers it."""

    def __init__(self, secret: str) -> None:
        """``secret`` is the required start of an address's path."""
        self._secret = secret

    def before(self, answer: Answer) -> Answer:
        """Wrap ``answer``: admitted requests see everything below the secret; others get a sentence."""

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
    """Whether a request names this machine as its host and, if it states an origin, comes from its page; only
    plain page loads may omit the origin."""
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    if len(hosts) != 1 or not _is_own_name(hosts[0]):
        return False
    return origins == [f"http://{hosts[0]}"] or (not origins and "Upgrade" not in request.headers)


def _is_own_name(host: str) -> bool:
    try:
        return urlsplit(f"//{host}").hostname in _OWN_NAMES
    except ValueError:
        return False
