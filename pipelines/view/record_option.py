"""The flag ``--record``."""

from typing import Annotated

import typer

RecordOption = Annotated[
    bool,
    typer.Option(
        "--record",
        help="Also write the folder record: a ROS 2 bag (MCAP) for RViz, Foxglove and `racecar view`.",
    ),
]
