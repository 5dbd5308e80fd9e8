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

Racecar: TypeAlias = Callable[..., "subprocess.CompletedProcess[str]"]


def in_own_process(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """The real command."""
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def in_this_process(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """The command but for its start; a process of its own imports and loads kernels for two seconds."""
    words = [*map(str, arguments)]
    out, error = StringIO(), StringIO()
    log = logging.StreamHandler(error)
    log.setFormatter(logging.Formatter(LOG_FORMAT))
    logging.getLogger().addHandler(log)
    try:
        with redirect_stdout(out), redirect_stderr(error):
            code = run(words)
    finally:
        logging.getLogger().removeHandler(log)
    return subprocess.CompletedProcess(words, code, out.getvalue(), error.getvalue())


def assert_refused(done: "subprocess.CompletedProcess[str]", complaint: str, out: Path) -> None:
    """In one sentence that says so, before anything was written to ``out``."""
    assert done.returncode == 2, done.stderr
    assert complaint in done.stderr
    assert done.stderr.strip().count("\n") == 0
    assert "Traceback" not in done.stderr
    assert not out.exists()
    assert [path.name for path in out.parent.iterdir() if path.name.startswith(".")] == []


def evaluated(racecar: Racecar, run: Path, *against: object) -> dict[str, Any]:
    """The figures by which the trajectory of a run differs from another or from relations."""
    figures = run / "figures.json"
    done = racecar("evaluate", run / "trajectory.tum", *against, "--json", figures)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(figures.read_text()))
