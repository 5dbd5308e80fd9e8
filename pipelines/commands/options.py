"""The flags that several commands share, so that each is spelt, explained and parsed the same everywhere."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.outputs import WritesFile

if TYPE_CHECKING:
    from racecar.pipelines.runs.bag_reading import BagReading

PAGE_WIDTH = 200
"""Characters of a line where tables go to a file or a pipe, so that none of their cells is broken."""
_LASER_POSE, _MOST_NUMBERS = "--laser-pose", 4
_FARTHEST = 1000.0
"""Metres and radians, beyond which a place is a slip of the keyboard."""


def _print_errors_only(quiet: bool) -> bool:
    if quiet:
        logging.getLogger("racecar").setLevel(logging.ERROR)
    return quiet


BagArgument = Annotated[
    Path,
    typer.Argument(
        metavar="BAG",
        help="A ROS 1 .bag, a ROS 2 bag folder, or a single .db3 or .mcap file.",
        show_default=False,
    ),
]
OutputFolderOption = Annotated[
    Path,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for the results; created if missing; other files in it are kept.",
        show_default=False,
    ),
]
MapOption = Annotated[
    Path,
    typer.Option(
        "--map",
        metavar="MAP",
        help="A map's YAML file, a folder with map.yaml, or a shipped map: building, track.",
        show_default=False,
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option("--config", metavar="FILE", help="YAML file that overrides settings.", show_default=False),
]
ScanTopicOption = Annotated[
    list[str] | None,
    typer.Option(
        "--scan-topic",
        metavar="TOPIC",
        help="Topic of the scans; by default found by type. Repeat it to use several lasers.",
        show_default=False,
    ),
]
OdomTopicOption = Annotated[
    str | None,
    typer.Option(
        "--odom-topic",
        metavar="TOPIC",
        help="Topic of the odometry; by default found by type.",
        show_default=False,
    ),
]
NoOdomOption = Annotated[bool, typer.Option("--no-odom", help="Ignore the bag's odometry.")]
NoImuOption = Annotated[bool, typer.Option("--no-imu", help="Ignore the bag's IMU.")]
ImuTopicOption = Annotated[
    str | None,
    typer.Option(
        "--imu-topic",
        metavar="TOPIC",
        help="Topic of the IMU; by default found by type.",
        show_default=False,
    ),
]


def join_laser_pose(arguments: Sequence[str]) -> list[str]:
    """The arguments with the three or four numbers behind --laser-pose in one: typer knows no option whose
    last number may be left out."""
    joined: list[str] = []
    for argument in arguments:
        is_room = joined[-2:-1] == [_LASER_POSE] and len(joined[-1].split()) < _MOST_NUMBERS
        if is_room and _is_number(argument):
            joined[-1] += f" {argument}"
        else:
            joined.append(argument)
    return joined


def _is_number(argument: str) -> bool:
    try:
        float(argument)
    except ValueError:
        return False
    return True


def parse_laser_pose(text: str) -> tuple[float, ...]:
    """x, y, yaw and perhaps roll. Raises UserError."""
    from racecar.maps.errors import UserError
    from racecar.pipelines.bags.sensor_place import slip_in

    try:
        numbers = tuple(float(number) for number in text.replace(",", " ").split())
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 4) or not all(abs(number) < _FARTHEST for number in numbers):
        raise UserError(
            f"{_LASER_POSE} {text!r} is not a place: give X Y YAW in metres and radians, and ROLL, 3.1416, "
            "if the laser hangs upside down."
        )
    if (slip := slip_in(numbers)) is not None:
        raise UserError(f"{_LASER_POSE} {text!r} is not a place: {slip}.")
    return numbers


LaserPoseOption = Annotated[
    str | None,
    typer.Option(
        _LASER_POSE,
        metavar="X Y YAW [ROLL]",
        help="The laser's place on the car in metres and radians; a laser that hangs upside down has the "
        "roll 3.1416. By default it is taken from transforms, or from the motion.",
        show_default=False,
    ),
]
StartOption = Annotated[
    float,
    typer.Option(
        "--start",
        metavar="SECONDS",
        min=0.0,
        help="Begin this long after the bag's first message.",
        show_default=False,
    ),
]
DurationOption = Annotated[
    float | None,
    typer.Option(
        "--duration",
        metavar="SECONDS",
        help="Read at most this much of the recording.",
        show_default=False,
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Same seed, same result.")]
JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Also write the figures to this file.", show_default=False),
    WritesFile(),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on a dask cluster, such as tcp://192.168.0.5:8786; by default on all cores of this "
        "machine.",
        show_default=False,
    ),
]
RecordOption = Annotated[
    bool,
    typer.Option(
        "--record",
        help="Also write the folder record: a ROS 2 bag (MCAP) for RViz, Foxglove and `racecar studio`.",
    ),
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print errors only.", callback=_print_errors_only)]


def bag_reading(
    *,
    scan_topic: list[str] | None,
    odom_topic: str | None,
    no_odom: bool,
    laser_pose: str | None,
    imu_topic: str | None = None,
    no_imu: bool = False,
    start: float = 0.0,
    duration: float | None = None,
) -> "BagReading":
    """How the flags say that a bag is read. Raises UserError when the laser's pose is none."""
    from racecar.pipelines.runs.bag_reading import BagReading

    return BagReading(
        scan_topics=tuple(scan_topic or ()),
        odom_topic=odom_topic,
        imu_topic=imu_topic,
        use_odometry=not no_odom,
        use_imu=not no_imu,
        base_from_laser=None if laser_pose is None else parse_laser_pose(laser_pose),
        start=start,
        duration=duration,
    )
