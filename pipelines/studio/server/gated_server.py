"""A web server that admits only the user, and accepts only messages that people can cause on a page.

viser's own server checks neither visitors nor messages. It opens connections with `serve` of websockets,
which takes a handler of requests and a class of connections: both are replaced while it starts.
"""

import io
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

import viser
from viser import ViserServer
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection

from racecar.maps.errors import UserError
from racecar.pipelines.studio.server.changed_script import changing_script
from racecar.pipelines.studio.server.gate import Gate
from racecar.pipelines.studio.server.hearing import LONGEST_MESSAGE, is_heard

_GUARDED = "1.1.1"
"""The version of viser that this was tested with."""
_CONTROLS, _COMMANDS = "_gui_input_handle_from_uuid", "_command_handle_from_uuid"
"""Where viser stores the controls of the side panel, and the keys; it has no public way to find one."""
_starting = threading.Lock()


def gated_server(host: str, port: int, title: str, gate: Gate) -> ViserServer:
    """Serve pages at a port. Raises UserError if this viser starts differently: better no page than one that
    is open to everyone."""
    started: list[ViserServer] = []

    def control_of(uuid: str) -> Any:
        if not started:
            return None
        gui = started[0].gui
        return getattr(gui, _CONTROLS).get(uuid) or getattr(gui, _COMMANDS).get(uuid)

    with _starting, redirect_stdout(io.StringIO()), _gated(gate, control_of) as is_gated:
        server = ViserServer(host, port, label=title, verbose=False)
        if not is_gated() or not (hasattr(server.gui, _CONTROLS) and hasattr(server.gui, _COMMANDS)):
            server.stop()
            raise UserError(
                f"The page cannot be guarded with viser {viser.__version__}, and everybody could use it: "
                f"`pip install 'viser=={_GUARDED}'` installs one with which it can."
            )
    started.append(server)
    return server


@contextmanager
def _gated(gate: Gate, control_of: Callable[[str], Any]) -> Iterator[Callable[[], bool]]:
    """Gate every server started during the block; yields a function that reports whether there was one."""
    serve, was_used = websockets_server.serve, threading.Event()

    def serve_gated(*arguments: Any, **options: Any) -> Any:
        if "process_request" in options:
            options["process_request"] = gate.before(changing_script(options["process_request"]))
            options["create_connection"] = _connection(control_of)
            options["max_size"] = LONGEST_MESSAGE
            was_used.set()
        return serve(*arguments, **options)

    websockets_server.serve = serve_gated  # type: ignore[assignment,misc]
    try:
        yield was_used.is_set
    finally:
        websockets_server.serve = serve  # type: ignore[misc]


def _connection(control_of: Callable[[str], Any]) -> type[ServerConnection]:
    class Connection(ServerConnection):
        """Receives only accepted messages."""

        async def recv(self, decode: bool | None = None) -> Any:
            while True:
                said = await super().recv(decode)
                if is_heard(said, control_of):
                    return said

    return Connection
