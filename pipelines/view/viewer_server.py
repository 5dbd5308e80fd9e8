"""The viewer of the rerun wheel, served to the browsers of this machine and nobody else."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

_LOOPBACK = "127.0.0.1"
_START_SECONDS = 30.0


@contextmanager
def serve_viewer(recording: Path, port: int | None = None) -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """Serve an ``.rrd`` file; yields the page's address and the serving process, which ends with the block.

    Without a ``port`` a free one is taken. Raises RuntimeError when the server does not start.
    """
    page_port, data_port = port or _free_port(), _free_port()
    command = [
        *(sys.executable, "-m", "rerun_cli", str(recording), "--serve-web", "--bind", _LOOPBACK),
        *("--port", str(data_port), "--web-viewer-port", str(page_port)),
    ]
    environment = {**os.environ, "CI": "1", "RUST_LOG": "error"}  # CI: rerun then sends no usage data
    process = subprocess.Popen(command, env=environment, start_new_session=True)
    try:
        _wait_for(process, (page_port, data_port))
        data = quote(f"rerun+http://{_LOOPBACK}:{data_port}/proxy", safe="")
        yield f"http://{_LOOPBACK}:{page_port}/?url={data}", process
    finally:
        os.killpg(process.pid, signal.SIGTERM)  # rerun_cli is a script that starts the server proper
        process.wait()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((_LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _wait_for(process: "subprocess.Popen[bytes]", ports: tuple[int, ...]) -> None:
    end = time.monotonic() + _START_SECONDS
    for port in ports:
        while not _is_listening(port):
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError("the rerun viewer did not start")
            time.sleep(0.1)


def _is_listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex((_LOOPBACK, port)) == 0
