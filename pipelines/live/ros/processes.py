"""Nodes and players as separate processes, as on a car."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


def private_environment(domain: int) -> dict[str, str]:
    """Environment variables that keep ROS's traffic on this machine and separate from other domains."""
    return {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONUNBUFFERED": "1",
    }


@contextmanager
def racecar_process(
    arguments: Sequence[str], environment: dict[str, str], log: Path, seconds_to_end: float = 120.0
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command within the block, with its output in a file; then send it Ctrl-C.

    It is killed if that does not end it.
    """
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", *arguments]
    with log.open("ab") as said:
        process = subprocess.Popen(command, env=environment, stdout=said, stderr=said)
        try:
            yield process
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(seconds_to_end)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
