"""``racecar simulate``: a car drives a map and records a bag."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import QuietOption
from racecar.pipelines.commands.outputs import WritesBag
from racecar.pipelines.commands.simulation_options import CarFlags, PlanOption


@dataclass(frozen=True, kw_only=True)
class _DriveFlags(CarFlags):
    """The rest of SimulationConfig that can be chosen."""

    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            metavar="SECONDS",
            min=1.0,
            max=100_000.0,
            help="How long to drive; by default until the whole map is seen, or for two laps of a track.",
        ),
    ] = None
    tilt: Annotated[
        float,
        typer.Option("--tilt", metavar="DEG", min=-10.0, max=10.0, help="How far the laser looks down."),
    ] = 0.0
    hills: Annotated[
        float,
        typer.Option("--hills", metavar="GRADE", min=0.0, max=0.3, help="Steepest slope, such as 0.06."),
    ] = 0.0
    kerbs: Annotated[
        float, typer.Option("--kerbs", metavar="M", min=0.0, max=1.0, help="Height of the campus' lawn.")
    ] = 0.0
    posts: Annotated[
        int,
        typer.Option(
            "--posts", metavar="N", min=0, max=12, help="Number of the robot's own posts in the laser's view."
        ),
    ] = 0
    carried: Annotated[
        float,
        typer.Option(
            "--carried",
            metavar="SECONDS",
            min=0.0,
            max=30.0,
            help="For this long in each 30 s the car is carried, its wheels standing.",
        ),
    ] = 0.0
    carrier: Annotated[
        bool, typer.Option("--carrier", help="The laser sees the body of whoever carries the car.")
    ] = False
    follower: Annotated[bool, typer.Option("--follower", help="A person walks 2 to 3 m behind the car.")] = (
        False
    )
    steering: Annotated[
        bool, typer.Option("--steering", help="Odometry turns by the steering angle, which is a little off.")
    ] = False
    scan_every: Annotated[
        float,
        typer.Option(
            "--every", metavar="SECONDS", min=0.0, max=60.0, help="Keep only one scan per interval."
        ),
    ] = 0.0
    scan_gaps: Annotated[
        float,
        typer.Option(
            "--scan-gaps",
            metavar="SECONDS",
            min=0.0,
            max=14.0,
            help="Keep no scans for this long in each 15 s.",
        ),
    ] = 0.0
    imu_rate: Annotated[
        float,
        typer.Option("--imu", metavar="HZ", min=0.0, max=1000.0, help="Rate of /imu, a cheap gyroscope."),
    ] = 0.0


def simulate(
    map: PlanOption,
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="BAG", help="Bag to write: a .bag file (ROS 1), else a folder (ROS 2)."
        ),
        WritesBag(),
    ],
    flags: _DriveFlags,
    quiet: QuietOption = False,
) -> None:
    """Drive a car through a map and record /scan, /odom and /ground_truth.

    The true path is also written beside the bag, for drive.bag to drive.ground_truth.tum.

    Some built-in plans are hard to map: twin_corridors, bare_corridor, long_track, and outdoors campus. Flags
    may be combined, as in --map campus --laser outdoor --hills 0.03 --kerbs 0.15.

    Example: racecar simulate --map building --out runs/drive.bag

    On a map of your own: racecar simulate --map runs/lab/map.yaml --out runs/drive.bag
    """
    from racecar.maps.map_files import load_map
    from racecar.pipelines.files.tum import save_tum
    from racecar.pipelines.runs.progress import progress_bar
    from racecar.pipelines.simulation.simulator import Simulation, ground_truth_file, write_bag
    from racecar.pipelines.simulation.simulator_config import SimulationConfig

    simulation = Simulation(load_map(map), SimulationConfig(**asdict(flags)))
    with progress_bar("Driving", quiet=quiet) as progress:
        write_bag(simulation, out, progress)
    truth = ground_truth_file(out)
    save_tum(simulation.ground_truth, truth)
    if not quiet:
        driven = abs(simulation.drive.speed).mean() * simulation.drive.seconds
        print(
            f"Drove {driven:.0f} m in {simulation.drive.seconds:.0f} s: {out} holds "
            f"{len(simulation.ground_truth)} scans, {truth} the true path."
        )
