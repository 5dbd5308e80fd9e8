"""Visitors of a page that are no browsers, and say whatever they like."""

import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import viser
from websockets.sync.client import ClientConnection, connect

from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK

VIEW: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": [0.0, 1.0, 0.0, 0.0],
    "position": [0.0, 0.0, 60.0],
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 1.0, 0.0],
    "fov": 0.17,
    "near": 1.0,
    "far": 1e5,
    "image_height": 600,
    "image_width": 900,
}
"""What a page says first."""


def loaded(address: str, **headers: str) -> tuple[int, str]:
    """Status and text of an answer."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


@contextmanager
def visiting(
    page: Page, *, host: str = "", path: str | None = None, **options: Any
) -> Iterator[ClientConnection]:
    """A connection as the page makes it, but for what is named."""
    _, _, own_host, own_path = page.address.split("/", 3)
    asked: dict[str, Any] = {"subprotocols": [f"viser-v{viser.__version__}"], "max_size": None}
    with (
        socket.create_connection((LOOPBACK, page.server.get_port())) as there,
        connect(
            f"ws://{host or own_host}/{own_path if path is None else path}",
            sock=there,
            **({"origin": f"http://{host or own_host}"} | asked | options),
        ) as connection,
    ):
        yield connection


def say(connection: ClientConnection, message: Any) -> None:
    """As a page does."""
    connection.send(msgspec.msgpack.encode(message))
