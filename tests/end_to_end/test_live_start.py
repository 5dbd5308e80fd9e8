"""Ctrl-C while a node starts."""

import subprocess
import sys
from pathlib import Path

import pytest

_NUMBA_DROPS_CTRL_C = """
import signal
from contextlib import suppress

from racecar.localization import warm_up as of_localizer
from racecar.mapping import warm_up as of_mapper
from racecar.pipelines.commands.cli import main

def interrupted(*_settings):
    with suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)

of_localizer.warm_up = of_mapper.warm_up = interrupted
main()
"""


@pytest.mark.parametrize(
    "command",
    [("localize", "--map", "ring", "--no-memory"), ("map", "--out", "out")],
    ids=lambda words: words[0],
)
def test_ctrl_c_that_numba_drops_ends_a_node(
    command: tuple[str, ...], ros: dict[str, str], tmp_path: Path
) -> None:
    done = subprocess.run(
        (sys.executable, "-c", _NUMBA_DROPS_CTRL_C, "live", *command),
        env=ros,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 130 and "Traceback" not in done.stderr
