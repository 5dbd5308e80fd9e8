"""A server that cannot be guarded does not serve."""

import socket
from contextlib import closing
from types import SimpleNamespace

import pytest
import viser
from websockets.asyncio import server as websockets_server

from racecar.maps.errors import UserError
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server import gated_server as module
from racecar.pipelines.studio.server.gate import LOOPBACK


def a_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def refuse_to_serve() -> None:
    """Try to open a page, which must fail and leave nothing open."""
    port = a_port()
    with pytest.raises(UserError, match=f"cannot be guarded with viser {viser.__version__}.*pip install"):
        Page("a page", port)
    with socket.socket() as visitor:
        assert visitor.connect_ex((LOOPBACK, port)) != 0


def test_a_viser_that_serves_in_another_way_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    own = SimpleNamespace(asyncio=SimpleNamespace(server=SimpleNamespace(serve=websockets_server.serve)))
    monkeypatch.setattr("viser.infra._infra.websockets", own)
    refuse_to_serve()


def test_a_viser_whose_controls_cannot_be_found_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CONTROLS", "_kept_elsewhere")
    refuse_to_serve()


def test_others_who_serve_in_the_same_process_are_left_alone() -> None:
    serve = websockets_server.serve
    with closing(Page("a page", 0)):
        assert websockets_server.serve is serve
