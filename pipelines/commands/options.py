"""The flags that several commands share, so that each is spelt, explained and parsed the same everywhere."""

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecar.pipelines.bags.reader import BagReader

PAGE_WIDTH = 200
"""Characters of a line where tables go to a file or a pipe, so that none of their cells is broken."""


def _print_errors_only(quiet: bool) -> bool:
    if quiet:
        logging.getLogger("racecar").setLevel(logging.ERROR)
    return quiet


BagArgument = Annotated[
    Path,
    typer.Argument(
        metavar="BAG",
        help="A ROS 1 .bag, a ROS 2 bag folder, or a lone .db3 or .mcap file.",
        show_default=False,
    ),
]
OutputFolderOption = Annotated[
    Path,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for the results; made when missing, other files in it stay.",
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
        help="Topic of the scans, found by type; give it once for each laser to use several.",
        show_default=False,
    ),
]
OdomTopicOption = Annotated[
    str | None,
    typer.Option(
        "--odom-topic", metavar="TOPIC", help="Topic of the odometry; found by type.", show_default=False
    ),
]
NoOdomOption = Annotated[bool, typer.Option("--no-odom", help="Leave the bag's odometry aside.")]
NoImuOption = Annotated[bool, typer.Option("--no-imu", help="Leave the bag's IMU aside.")]
ImuTopicOption = Annotated[
    str | None,
    typer.Option("--imu-topic", metavar="TOPIC", help="Topic of the IMU; found by type.", show_default=False),
]
LaserPoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--laser-pose",
        metavar="X Y YAW",
        help="The laser's place on the car in metres and radians; otherwise from its transforms.",
        show_default=False,
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Same seed, same result.")]
JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Also write the figures to this file.", show_default=False),
]
RecordOption = Annotated[
    bool,
    typer.Option(
        "--record",
        help="Also write the folder record: a ROS 2 bag (MCAP) for RViz, Foxglove and `racecar view`.",
    ),
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print errors only.", callback=_print_errors_only)]


def open_bag(
    path: Path,
    *,
    scan_topic: list[str] | None,
    odom_topic: str | None,
    no_odom: bool,
    laser_pose: tuple[float, float, float] | None,
    imu_topic: str | None = None,
    no_imu: bool = False,
) -> "BagReader":
    """The bag, read as the flags say. Raises UserError when it cannot be."""
    import numpy as np

    from racecar.pipelines.bags.reader import BagReader

    return BagReader(
        path,
        scan_topic=scan_topic,
        odom_topic=odom_topic,
        imu_topic=imu_topic,
        use_odometry=not no_odom,
        use_imu=not no_imu,
        base_from_laser=None if laser_pose is None else np.array(laser_pose),
    )
