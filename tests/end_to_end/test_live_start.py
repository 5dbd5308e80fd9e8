"""Ctrl-C while a node starts."""

import subprocess
import sys

_NUMBA_DROPS_CTRL_C = """
import signal
from contextlib import suppress

from racecar.localization import warm_up
from racecar.pipelines.commands.cli import main

def interrupted(_config):
    with suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)

warm_up.warm_up = interrupted
main()
"""


def test_ctrl_c_that_numba_drops_ends_a_localizer(ros: dict[str, str]) -> None:
    words = (sys.executable, "-c", _NUMBA_DROPS_CTRL_C, "live", "localize", "--map", "ring", "--no-memory")
    done = subprocess.run(words, env=ros, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode in (0, 130) and "Traceback" not in done.stderr
