"""The page's address in a real browser, and web pages from elsewhere beside it."""

import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

import pytest
import viser

from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server import changed_script
from racecar.pipelines.studio.server.gate import LOOPBACK
from racecar.pipelines.studio.watch.watch_screen import WatchScreen
from tests.pipelines.studio.chromium import Opened, opened, running

_OPENS = """([address, protocol]) => new Promise(resolve => {
    const socket = new WebSocket(address, [protocol]);
    socket.onopen = () => resolve(true);
    socket.onerror = () => resolve(false);
})"""
"""Whether a web page can open a socket."""


class _ForeignPage(BaseHTTPRequestHandler):
    """A web page of somebody else's."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<title>elsewhere</title>")

    def log_message(self, *_: object) -> None:
        """Nothing is logged."""


@contextmanager
def elsewhere() -> Iterator[str]:
    """The address of a foreign web page."""
    with ThreadingHTTPServer((LOOPBACK, 0), _ForeignPage) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://{LOOPBACK}:{server.server_address[1]}/"
        server.shutdown()


@contextmanager
def tunnel(port: int) -> Iterator[int]:
    """Another port that leads to a port, as of an SSH client."""

    def carry(source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):  # either end may be closed
            while data := source.recv(1 << 16):
                target.sendall(data)
            target.shutdown(socket.SHUT_WR)

    def lead(entrance: socket.socket) -> None:
        while True:
            try:
                near, _ = entrance.accept()
            except OSError:
                return
            far = socket.create_connection((LOOPBACK, port))
            for ends in ((near, far), (far, near)):
                threading.Thread(target=carry, args=ends, daemon=True).start()

    with socket.create_server((LOOPBACK, 0)) as entrance:
        threading.Thread(target=lead, args=(entrance,), daemon=True).start()
        yield int(entrance.getsockname()[1])
        entrance.shutdown(socket.SHUT_RDWR)


def watch_screen(page: Page) -> WatchScreen:
    return WatchScreen(page, tells_places=True)


@pytest.mark.slow
def test_the_script_that_runs_is_the_changed_one(chromium: Any) -> None:
    with running(watch_screen) as studio, opened(chromium, studio) as page:
        script = max(page.tab.locator("script").all_inner_texts(), key=len)
    for replaced in (changed_script._SENDER, changed_script._TRANSPARENT):
        assert not re.search(replaced.removesuffix("g").strip("/"), script)
    assert script.count("transparent:!1,side:2,map:") == 2


@pytest.mark.slow
def test_a_page_from_elsewhere_cannot_open_it_even_if_it_knows_the_address(chromium: Any) -> None:
    with running(watch_screen) as studio, opened(chromium, studio) as page, elsewhere() as address:
        other = chromium.new_context().new_page()
        other.goto(address)
        host, protocol = urlsplit(studio.address).netloc, f"viser-v{viser.__version__}"
        for tried in (f"ws://{host}", studio.address.replace("http", "ws")):
            assert not other.evaluate(_OPENS, [tried, protocol])
        assert page.tab.evaluate(_OPENS, [studio.address.replace("http", "ws"), protocol])
        assert not page.tab.evaluate(_OPENS, [f"ws://{host}", protocol])
        assert len(studio.server.get_clients()) == 1
        other.goto(f"http://{host}/")
        assert "Open the page by the whole address" in other.inner_text("body")
        other.context.close()


@pytest.mark.slow
def test_it_is_opened_twice_and_reloaded_and_through_a_tunnel(chromium: Any) -> None:
    with running(watch_screen) as studio, opened(chromium, studio) as page, opened(chromium, studio):
        assert len(studio.server.get_clients()) == 2
        page.tab.reload()
        page.wait_for(lambda: page.says("The node is starting"), "the page after it was reloaded")
        with tunnel(studio.server.get_port()) as port:
            far = Opened(page.tab, studio)
            far.tab.goto(studio.address.replace(str(studio.server.get_port()), str(port)))
            far.wait_for(lambda: far.says("The node is starting"), "the page behind a tunnel")
            page.tab.goto("about:blank")  # before the tunnel ends


@pytest.mark.slow
def test_a_server_that_follows_has_the_same_address(chromium: Any) -> None:
    with running(watch_screen) as studio, opened(chromium, studio) as page:
        address, port = studio.address, studio.server.get_port()
        studio.stop()
        studio.server.stop()
        next_studio = Page("the next", port)
        try:
            assert next_studio.address == address
            next_studio.enter(lambda: watch_screen(next_studio))
            page.wait_for(lambda: next_studio.server.get_clients(), "the page to find the next server")
        finally:
            next_studio.close()
