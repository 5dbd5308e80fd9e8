"""Nodes and players as processes of their own, as they run on a car."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


def private_environment(domain: int) -> dict[str, str]:
    """Variables that keep ROS's traffic on this machine and apart from that of other domains."""
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
    """Run a command while the block lasts, what it says going to a file; then it gets Ctrl-C.

    Should it not end by that, it is killed.
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
