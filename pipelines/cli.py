"""The command ``racecar``."""

import errno
import logging
import os
import sys

import typer

from racecar.maps.errors import UserError
from racecar.pipelines.commands.benchmark import benchmark
from racecar.pipelines.commands.check import check
from racecar.pipelines.commands.demo import demo
from racecar.pipelines.commands.evaluate import evaluate
from racecar.pipelines.commands.experiment import experiment
from racecar.pipelines.commands.live import live
from racecar.pipelines.commands.localize import localize
from racecar.pipelines.commands.map import map
from racecar.pipelines.commands.play import play
from racecar.pipelines.commands.simulate import simulate
from racecar.pipelines.commands.view import view
from racecar.pipelines.live.ros.arguments import RosCommand

LOG_FORMAT = "racecar: %(message)s"
_USER_ERROR = 2
_INTERRUPTED = 130
_MENDABLE_BY_USER = {errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EPERM, errno.EROFS}

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.callback()
def _describe() -> None:
    """From a rosbag of a small car with a 2D LiDAR to a map, and from the map to the car's pose."""


for _command in (map, localize, evaluate, simulate, check, view, demo):
    app.command()(_command)
app.command(cls=RosCommand)(play)
app.add_typer(benchmark, name="benchmark")
app.add_typer(experiment, name="experiment")
app.add_typer(live, name="live")


def main() -> None:
    """Run a command and leave with its exit code: 0, 1 for a fault of ours, 2 for one of the user's."""
    logging.basicConfig(format=LOG_FORMAT, level=logging.WARNING)
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run a command and return its exit code; errors become one sentence on stderr."""
    try:
        return int(app(arguments or ["--help"], prog_name="racecar", standalone_mode=False) or 0)
    except KeyboardInterrupt:
        _say("Stopped.")
        return _INTERRUPTED
    except Exception as error:
        if os.environ.get("RACECAR_DEBUG") == "1":
            raise
        return _explain(error)


def _explain(error: Exception) -> int:
    if isinstance(error, UserError):
        _say(str(error))
        return _USER_ERROR
    if hasattr(error, "format_message"):  # typer's usage errors, whose class moved between its releases
        _say(f"{error.format_message().rstrip('.')} (see --help).")
        return _USER_ERROR
    if isinstance(error, OSError) and error.errno in _MENDABLE_BY_USER:
        _say(f"Cannot write {error.filename or 'a file'}: {(error.strerror or '').lower()}.")
        return _USER_ERROR
    summary = " ".join(str(error).split()) or "no message"
    _say(
        f"This is a fault in racecar, not yours ({type(error).__name__}: {summary}); please run it again "
        "with RACECAR_DEBUG=1 and report what it prints."
    )
    return 1


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)


if __name__ == "__main__":
    main()
