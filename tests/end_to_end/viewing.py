"""``racecar studio`` running, and what of a run can be seen in the browser."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

SCREEN = 1400, 900
"""Pixels of a tab on which the things are as large as people see them."""
_COLORS = {
    "walls": (27, 31, 36),
    "path": (0, 158, 200),
    "car": (0, 158, 115),
    "scan": (230, 159, 0),
}
_WITHIN = 40
_FEWEST = 20


@dataclass(frozen=True)
class Seen:
    """How many pixels are nearly of the colour of each thing."""

    counts: dict[str, int]

    @property
    def complete(self) -> bool:
        """Whether walls, path, scan and car are all to be seen."""
        return min(self.counts.values()) > _FEWEST


def pixels_of(tab: Any, path: Path) -> Seen:
    """What a tab shows, which is written as PNG too."""
    tab.screenshot(path=path)
    picture = np.asarray(Image.open(path).convert("RGB")).astype(np.int64)
    return Seen(
        {
            name: int(np.count_nonzero(np.abs(picture - color).max(axis=2) < _WITHIN))
            for name, color in _COLORS.items()
        }
    )


@contextmanager
def viewed(run: Path, port: int = 0, ended_by: signal.Signals = signal.SIGTERM) -> Iterator[str]:
    """The address of a ``racecar studio`` that runs meanwhile."""
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", "studio", str(run), "--no-browser"]
    command += ["--port", str(port)]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert process.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:\S+", process.stdout.readline())
        assert found is not None, "racecar studio did not start"
        yield found[0]
    finally:
        process.send_signal(ended_by)
        try:
            process.wait(30)
        finally:
            process.kill()
