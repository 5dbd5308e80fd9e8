"""A node while another process plays a bag to it."""

import os
import time
from collections.abc import Callable
from json import loads
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.live.node_listener import NodeListener, listening
from benchmarks.live.played_drives import PlayedDrive
from racecar.maps.errors import UserError
from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.live.ros.processes import private_environment, racecar_process

_READY_SECONDS = 120.0
"""Seconds; a node compiles its kernels when it first starts, which takes about a minute."""
_MEMORY_EVERY = 1.0
"""Seconds between measurements of a node's memory."""


def play_to_node(
    arguments: list[str], drive: PlayedDrive, odom_topic: str | None, domain: int, speed: float
) -> tuple[dict[str, Any], NodeListener]:
    """Play the bag to a node; returns its summary, with its memory every second, and its listener.

    Raises UserError if the node does not start.
    """
    environment = private_environment(domain)
    os.environ.update({name: environment[name] for name in environment if name.startswith("ROS_")})
    with TemporaryDirectory() as folder:
        summary, log = Path(folder) / "summary.json", Path(folder) / "log"
        remapped = ["--ros-args", "-r", f"odom:={odom_topic}"] if odom_topic else []
        command = [*arguments, "--json", str(summary), *remapped]
        with listening() as heard, racecar_process(command, environment, log) as node:
            _wait_for(lambda: heard.is_node_there() or node.poll() is not None)
            if node.poll() is not None:
                raise UserError(f"The node does not start: {log.read_text().strip()}")
            memory: list[float] = []
            play = ["play", str(drive.bag), "--quiet", "--speed", str(speed)]
            play += ["--listeners", "2", "--wait", "30"]  # the node and this process
            began, stolen = time.monotonic(), _stolen_seconds()
            with racecar_process(play, environment, log) as player:
                while player.poll() is None:
                    memory.append(resident_memory_mb(node.pid))
                    time.sleep(_MEMORY_EVERY)
            share = (_stolen_seconds() - stolen) / (time.monotonic() - began)
            time.sleep(1.0)
        return {**loads(summary.read_text()), "memory_mb": memory, "stolen_share": share}, heard


def _stolen_seconds() -> float:
    """Processor seconds that the host gave to others since this machine started; nan if unknown."""
    try:
        stolen = Path("/proc/stat").read_text().split(maxsplit=9)[8]
    except (OSError, IndexError):
        return float("nan")
    return int(stolen) / os.sysconf("SC_CLK_TCK")


def _wait_for(condition: Callable[[], bool]) -> None:
    until = time.monotonic() + _READY_SECONDS
    while not condition():
        if time.monotonic() > until:
            raise UserError(f"The node was not ready after {_READY_SECONDS:.0f} s.")
        time.sleep(0.1)
