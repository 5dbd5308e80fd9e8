"""The command ``racecar``."""

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from inspect import getdoc
from typing import Annotated

import typer
from typer.models import CommandInfo

from racecar.maps.errors import UserError
from racecar.pipelines.commands.check import check
from racecar.pipelines.commands.config import config
from racecar.pipelines.commands.demo import demo
from racecar.pipelines.commands.evaluate import evaluate
from racecar.pipelines.commands.experiment import experiment
from racecar.pipelines.commands.live import live
from racecar.pipelines.commands.localize import localize
from racecar.pipelines.commands.map import map
from racecar.pipelines.commands.mend import mend
from racecar.pipelines.commands.merge import merge
from racecar.pipelines.commands.options import join_laser_pose, ungrouped
from racecar.pipelines.commands.outputs import checked
from racecar.pipelines.commands.play import play
from racecar.pipelines.commands.render import render
from racecar.pipelines.commands.results import INTERRUPTED
from racecar.pipelines.commands.simulate import simulate
from racecar.pipelines.commands.studio import studio
from racecar.pipelines.commands.terminal import leave_terminal, one_line, prepare_terminal
from racecar.pipelines.commands.track import track
from racecar.pipelines.live.ros.arguments import ROS_ARGUMENTS, RosCommand
from racecar.pipelines.runs.error_sentences import in_one_sentence, is_mendable_by_user
from racecar.pipelines.runs.interrupts import end_like_ctrl_c

_USER_ERROR = 2
_UNREAD = 141
"""The code that a shell reports for a program whose output is no longer read."""

app = typer.Typer(pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]})


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        from racecar import __version__

        print(f"racecar {__version__}")
        raise typer.Exit


@app.callback()
def _describe(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """From a rosbag of a small car with a 2D LiDAR to a map, and from the map to the car's pose.

    Exit codes: 0 done, 1 fault in racecar, 2 wrong input, 3 poor result (--strict), 130 interrupted.
    """


for _command in (map, merge, render, mend, track, localize, evaluate, simulate, check, config, studio, demo):
    app.command()(_command)
app.command(cls=RosCommand)(play)
app.add_typer(experiment, name="experiment")
app.add_typer(live, name="live")


def commands_of(group: typer.Typer, title: str) -> Iterator[tuple[str, CommandInfo]]:
    """Yield every command with the words that run it."""
    for command in group.registered_commands:
        assert command.callback is not None
        yield f"{title} {command.name or command.callback.__name__}", command
    for child in group.registered_groups:
        if child.typer_instance is not None:
            yield from commands_of(child.typer_instance, f"{title} {child.name}")


def _unwrap_help(command: CommandInfo) -> None:
    """Let help wrap at the terminal's width instead of at the line breaks of the source."""
    text = command.help or getdoc(command.callback) or ""
    command.help = "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def complete(group: typer.Typer, title: str) -> None:
    """Complete all commands with what they share: wrapped help, and a check of their outputs."""
    for name, command in commands_of(group, title):
        _unwrap_help(command)
        assert command.callback is not None
        command.callback = checked(ungrouped(command.callback), name)


complete(app, "racecar")


def main(group: typer.Typer = app, title: str = "racecar") -> None:
    """Run a command and exit with its code: 0, 1 for a bug of ours, 2 for a mistake of the user."""
    prepare_terminal()
    end_like_ctrl_c()
    # Our matrices are too small for multithreaded linear algebra, whose threads wait in busy loops.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    code = run(sys.argv[1:], group, title)
    leave_terminal()
    sys.exit(code)


def run(arguments: list[str], group: typer.Typer = app, title: str = "racecar") -> int:
    """Run a command of a group and return its exit code; errors become one sentence on stderr."""
    log = logging.getLogger("racecar")
    level = log.level  # changed by --quiet
    try:
        _refuse_empty(arguments)
        arguments = join_laser_pose(arguments) or ["--help"]
        code = int(group(arguments, prog_name=title, standalone_mode=False) or 0)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        _say("Stopped.")
        return INTERRUPTED
    except (Exception, SystemExit) as error:
        if _is_unread(error):
            return _UNREAD
        if isinstance(error, SystemExit) and isinstance(error.code, int):
            return error.code  # typer exits this way after completing a command for the shell
        if os.environ.get("RACECAR_DEBUG") == "1":
            raise
        return _explain(error)
    finally:
        log.setLevel(level)


def _refuse_empty(arguments: list[str]) -> None:
    """An empty path would mean the current folder; it usually comes from a shell variable that is not set."""
    before = "racecar"
    for argument in arguments:
        if argument == ROS_ARGUMENTS:
            return
        name, is_given, value = (
            argument.partition("=") if argument.startswith("--") else (before, "=", argument)
        )
        if is_given and not value.strip():
            raise UserError(f"The value after {name} is empty; give one (a dot is the current folder).")
        before = argument


def _is_unread(error: BaseException) -> bool:
    """Whether the output is no longer read, as in ``| head``; rich then exits by SystemExit."""
    return isinstance(error, BrokenPipeError) or isinstance(error.__context__, BrokenPipeError)


def _explain(error: BaseException) -> int:
    if hasattr(error, "format_message"):  # typer's usage errors, whose class moved between its releases
        _say(f"{error.format_message().rstrip('.')} (see --help).")
        return _USER_ERROR
    _say(in_one_sentence(error))
    return _USER_ERROR if is_mendable_by_user(error) else 1


def _say(sentence: str) -> None:
    with suppress(OSError):  # the output is no longer read
        print(one_line(sentence), file=sys.stderr)


if __name__ == "__main__":
    main()
