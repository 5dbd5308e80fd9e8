"""Commands that pass arguments after ``--ros-args`` on to ROS, as nodes do."""

from typing import Any

import typer.core

ROS_ARGUMENTS = "--ros-args"


class RosCommand(typer.core.TyperCommand):
    """A command whose own flags end where ROS's begin; those are in the context's ``obj``."""

    def parse_args(self, context: Any, arguments: list[str]) -> list[str]:
        """Keep ROS's arguments from being rejected as unknown flags."""
        cut = arguments.index(ROS_ARGUMENTS) if ROS_ARGUMENTS in arguments else len(arguments)
        context.obj = arguments[cut:]
        rest: list[str] = super().parse_args(context, arguments[:cut])
        return rest
