"""``racecar simulate``: drive a car on a map and record a bag."""

from pathlib import Path
from typing import Annotated, Any

import typer

from racecar.pipelines.commands.options import QuietOption
from racecar.pipelines.commands.outputs import WritesBag
from racecar.pipelines.commands.simulation_options import DRIVE_FLAGS, PlanOption, takes_settings


@takes_settings(DRIVE_FLAGS)
def simulate(
    map: PlanOption,
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="BAG", help="Bag to write: a .bag file (ROS 1), else a folder (ROS 2)."
        ),
        WritesBag(),
    ],
    quiet: QuietOption = False,
    **chosen: Any,
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

    simulation = Simulation(load_map(map), SimulationConfig(**chosen))
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
