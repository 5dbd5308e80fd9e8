"""``racecar`` as a user runs it, in a process of its own or, far cheaper, in that of the test."""

import json
import logging
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.terminal import LOG_FORMAT

Done: TypeAlias = "subprocess.CompletedProcess[str]"
Racecar: TypeAlias = Callable[..., Done]
"""What it is given are the words of the command, and the exit ``code`` to be expected, None for any."""


def in_own_process(*arguments: object, code: int | None = 0) -> Done:
    """The real command."""
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", *map(str, arguments)]
    return _checked(subprocess.run(command, capture_output=True, text=True, check=False), code)


def in_this_process(*arguments: object, code: int | None = 0) -> Done:
    """The command but for its start; a process of its own imports and loads kernels for two seconds."""
    words = [*map(str, arguments)]
    out, error = StringIO(), StringIO()
    log = logging.StreamHandler(error)
    log.setFormatter(logging.Formatter(LOG_FORMAT))
    logging.getLogger().addHandler(log)
    try:
        with redirect_stdout(out), redirect_stderr(error):
            ended = run(words)
    finally:
        logging.getLogger().removeHandler(log)
    return _checked(subprocess.CompletedProcess(words, ended, out.getvalue(), error.getvalue()), code)


def _checked(done: Done, code: int | None) -> Done:
    assert code in (None, done.returncode), f"{done.returncode}: {done.stderr}"
    return done


def simulate(racecar: Racecar, bag: Path, seconds: float, *flags: object) -> None:
    """A short drive in the building, with its truth beside it."""
    drive = ("--map", "building", "--noise", "slight", "--duration", seconds)
    racecar("simulate", *drive, "--out", bag, "--quiet", *flags)


def report_of(run: Path) -> dict[str, Any]:
    """The report in a run's folder."""
    return dict(json.loads((run / "report.json").read_text()))


def assert_refused(done: Done, complaint: str, out: Path) -> None:
    """In one sentence that says so, before anything was written to ``out``."""
    assert complaint in done.stderr
    assert done.stderr.strip().count("\n") == 0
    assert "Traceback" not in done.stderr
    assert not out.exists()
    assert [path.name for path in out.parent.iterdir() if path.name.startswith(".")] == []


def evaluated(racecar: Racecar, run: Path, *against: object) -> dict[str, Any]:
    """The figures by which the trajectory of a run differs from another or from relations."""
    figures = run / "figures.json"
    racecar("evaluate", run / "trajectory.tum", *against, "--json", figures)
    return dict(json.loads(figures.read_text()))
