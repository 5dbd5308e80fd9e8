"""Flags shared by several commands, so that each is spelled, explained and parsed the same everywhere.

Flags that always appear together form a group: a dataclass, for which a command has one parameter.
"""

import inspect
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines.commands.outputs import WritesFile

if TYPE_CHECKING:
    from racecar.pipelines.runs.bag_reading import BagReading

_LASER_POSE, _MOST_NUMBERS = "--laser-pose", 4


def _print_errors_only(quiet: bool) -> bool:
    if quiet:
        logging.getLogger("racecar").setLevel(logging.ERROR)
    return quiet


BagArgument = Annotated[
    Path,
    typer.Argument(metavar="BAG", help="A ROS 1 .bag, a ROS 2 bag folder, or a single .db3 or .mcap file."),
]
OutputFolderOption = Annotated[
    Path,
    typer.Option(
        "--out", metavar="DIR", help="Folder for the results; created if missing; other files in it are kept."
    ),
]
MapOption = Annotated[
    Path,
    typer.Option(
        "--map",
        metavar="MAP",
        help="A map's YAML file, a folder with map.yaml, or a shipped map: building, track.",
    ),
]
StartOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--initial-pose", metavar="X Y YAW", help="Where the car starts, in metres and radians of the map."
    ),
]
ConfigOption = Annotated[
    Path | None, typer.Option("--config", metavar="FILE", help="YAML file that overrides settings.")
]
ScanTopicOption = Annotated[
    list[str] | None,
    typer.Option(
        "--scan-topic",
        metavar="TOPIC",
        help="Topic of the scans; by default found by type. Repeat it to use several lasers.",
    ),
]
OdomTopicOption = Annotated[
    str | None,
    typer.Option("--odom-topic", metavar="TOPIC", help="Topic of the odometry; by default found by type."),
]


def join_laser_pose(arguments: Sequence[str]) -> list[str]:
    """Join the three or four numbers after --laser-pose in one argument: typer has no option whose last
    number is optional."""
    joined: list[str] = []
    for argument in arguments:
        is_room = joined[-2:-1] == [_LASER_POSE] and len(joined[-1].split()) < _MOST_NUMBERS
        if is_room and len(numbers_in(argument) or ()) == 1:
            joined[-1] += f" {argument}"
        else:
            joined.append(argument)
    return joined


def numbers_in(text: str) -> list[float] | None:
    """Numbers separated by blanks or commas, as in '3.2 -0.5' or '3.2,-0.5'; None for any other text."""
    try:
        return [float(number) for number in text.replace(",", " ").split()]
    except ValueError:
        return None


def parse_laser_pose(text: str) -> tuple[float, ...]:
    """x, y, yaw and optionally roll. Raises UserError."""
    from racecar.maps.errors import UserError
    from racecar.pipelines.bags.car_frames import slip_in

    numbers = tuple(numbers_in(text) or ())
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
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Same seed, same result.")]
JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Also write the figures to this file."),
    WritesFile(),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on a dask cluster, such as tcp://192.168.0.5:8786; by default on all cores of this "
        "machine.",
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


@dataclass(frozen=True, kw_only=True)
class ReadingFlags:
    """How to read a bag."""

    scan_topic: ScanTopicOption = None
    odom_topic: OdomTopicOption = None
    no_odom: Annotated[bool, typer.Option("--no-odom", help="Ignore the bag's odometry.")] = False
    imu_topic: Annotated[
        str | None,
        typer.Option("--imu-topic", metavar="TOPIC", help="Topic of the IMU; by default found by type."),
    ] = None
    no_imu: Annotated[bool, typer.Option("--no-imu", help="Ignore the bag's IMU.")] = False
    laser_pose: LaserPoseOption = None
    start: Annotated[
        float,
        typer.Option(
            "--start",
            metavar="SECONDS",
            min=0.0,
            help="Begin this long after the bag's first message.",
            show_default=False,
        ),
    ] = 0.0
    duration: Annotated[
        float | None,
        typer.Option("--duration", metavar="SECONDS", help="Read at most this much of the recording."),
    ] = None

    def parsed(self) -> "BagReading":
        """The parsed values, as runs expect them. Raises UserError when the laser's pose is invalid."""
        from racecar.pipelines.runs.bag_reading import BagReading

        return BagReading(
            scan_topic=tuple(self.scan_topic or ()),
            odom_topic=self.odom_topic,
            imu_topic=self.imu_topic,
            use_odometry=not self.no_odom,
            use_imu=not self.no_imu,
            laser_pose=None if self.laser_pose is None else parse_laser_pose(self.laser_pose),
            start=self.start,
            duration=self.duration,
        )


def ungrouped(command: Callable[..., Any]) -> Callable[..., Any]:
    """Replace each group parameter of a command by the flags of the group, as typer expects."""
    signature = inspect.signature(command)
    groups: dict[str, Any] = {
        name: each.annotation for name, each in signature.parameters.items() if is_dataclass(each.annotation)
    }
    if not groups:
        return command

    @wraps(command)
    def group_and_run(**flags: Any) -> Any:
        grouped = {
            name: group(**{field.name: flags.pop(field.name) for field in fields(group)})
            for name, group in groups.items()
        }
        return command(**flags, **grouped)

    parameters = [
        flag.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for name, each in signature.parameters.items()
        for flag in (inspect.signature(groups[name]).parameters.values() if name in groups else [each])
    ]
    group_and_run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return group_and_run
