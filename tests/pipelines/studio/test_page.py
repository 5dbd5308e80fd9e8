"""The page's server: ports that are taken, visitors that say nothing, a server that has ended; and what is
asked before something is lost."""

import logging
import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.commands.page_options import _run
from racecar.pipelines.studio import page as page_module
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen
from racecar.pipelines.studio.server.gate import LOOPBACK


@contextmanager
def taken(port: int) -> Iterator[int]:
    """A port that something else listens at; skips where that is impossible."""
    with socket.socket() as other:
        try:
            other.bind((LOOPBACK, port))
        except OSError:
            pytest.skip(f"port {port} is in use on this machine")
        other.listen()
        yield other.getsockname()[1]


@pytest.mark.parametrize("port", [0, 65535])
def test_instead_of_a_port_that_is_taken_it_has_a_free_one(
    port: int, caplog: pytest.LogCaptureFixture
) -> None:
    with taken(port) as used, closing(Page("a page", used)) as page:
        assert page.server.get_port() != used
        with socket.create_connection((LOOPBACK, page.server.get_port()), timeout=5.0):
            pass
        assert caplog.messages == [
            f"The page is not at port {used} (Address already in use): a free one is taken."
        ]


def test_a_free_port_is_taken_as_it_is_wanted(caplog: pytest.LogCaptureFixture) -> None:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        port = probe.getsockname()[1]
    with closing(Page("a page", port)) as page:
        assert page.address.startswith(f"http://{LOOPBACK}:{port}/")
    assert not caplog.messages


def test_a_server_that_has_ended_is_told_once_and_the_work_ends(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(page_module, "_LOOK_EVERY", 0.1)
    with closing(Page("a page", 0)) as page:
        worker = threading.Thread(target=page.run)
        worker.start()
        page.server.stop()
        worker.join(10.0)
        assert not worker.is_alive()
        assert caplog.messages == [
            f"The page at {page.address} can no longer be reached, and is not drawn any more."
        ]
        for _ in range(2000):
            page.request(lambda: None)
        assert len(caplog.messages) == 1


def test_a_visitor_who_says_nothing_is_no_error(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO), closing(Page("a page", 0)) as page:
        for said in (b"", b"GET", b"\x00\xff\r\n\r\n"):
            with socket.create_connection((LOOPBACK, page.server.get_port()), timeout=5.0) as visitor:
                visitor.sendall(said)
                visitor.shutdown(socket.SHUT_WR)
                while visitor.recv(1000):
                    pass
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]


class Unsaved(Screen):
    """Something is lost when it is left."""

    would_be_lost = "It is not saved: save it, or press again to leave without it."  # type: ignore[assignment]


def test_ctrl_c_says_first_what_is_not_saved(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = []

    def interrupted() -> None:
        runs.append(capsys.readouterr().out)
        raise KeyboardInterrupt

    with closing(Page("a page", 0)) as page:
        monkeypatch.setattr(page, "run", interrupted)
        page.enter(Unsaved)
        _run(page)
    assert len(runs) == 2
    assert "It is not saved" in runs[1]


def test_what_is_confirmed_once_is_asked_again_the_next_time() -> None:
    with closing(Page("a page", 0)) as page:
        for _ in range(2):
            for loss in ("a map", "edits"):
                with pytest.raises(UserError, match=loss):
                    page.confirm(loss)
            page.confirm("edits")
