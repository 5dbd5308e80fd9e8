"""Nodes and players as processes of their own, as they run on a car."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


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
    arguments: Sequence[str], environment: dict[str, str], seconds_to_end: float = 120.0
) -> Iterator[subprocess.Popen[str]]:
    """Run a command while the block lasts; then it gets Ctrl-C, and is killed should it not end."""
    command = [sys.executable, "-m", "pipelines.cli", *arguments]
    process = subprocess.Popen(command, env=environment, text=True, stderr=subprocess.PIPE)
    try:
        yield process
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=seconds_to_end)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
