"""``racecar live simulate``: a car that drives in a simulated world, for running nodes."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines.commands.simulation_options import CAR_FLAGS, PlanOption, takes_settings

if TYPE_CHECKING:
    from racecar.pipelines.simulation.driven_simulation import DrivenSimulation

_NEAR = 0.5
"""Maximum metres from the requested start to a place where the car can drive."""


@takes_settings(CAR_FLAGS)
def simulate(
    *,
    context: typer.Context,
    map: PlanOption,
    start: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            "--start",
            metavar="X Y YAW",
            help="Where the car starts, in metres and radians of the map; by default near its origin.",
        ),
    ] = None,
    pace: Annotated[
        float,
        typer.Option(
            "--pace", metavar="X", min=0.1, max=10.0, help="Simulated seconds in one of the computer's."
        ),
    ] = 1.0,
    namespace: Annotated[
        str,
        typer.Option(
            "--namespace",
            metavar="NAME",
            help="Of the topics and frames of this car, so that several can drive at once.",
        ),
    ] = "",
    teleport: Annotated[
        bool, typer.Option("--teleport", help="/initialpose, RViz's 2D Pose Estimate, carries the car.")
    ] = False,
    **chosen: Any,
) -> None:
    """Simulate a car on a map: it publishes /scan, /odom, /tf and /ground_truth. Ctrl-C ends it.

    It drives to goals on /goal_pose (RViz's 2D Goal Pose), or follows commands on /cmd_vel or /drive, each of
    which holds for 0.6 s. At most 20 scans a second are published.

    Example: racecar live simulate --map building
    """
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()

    import numpy as np

    from racecar.maps.map_files import load_map
    from racecar.pipelines.live.ros.run import ros_node, spin
    from racecar.pipelines.live.simulator_node import SimulatorNode
    from racecar.pipelines.runs.interrupts import STOP_SIGNALS, stop_request
    from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation

    seed, laser = chosen.pop("seed"), chosen.pop("laser")
    wanted = None if start is None else np.array(start)
    simulation = DrivenSimulation(load_map(map), Conditions(**chosen), seed, wanted, laser)
    if start is not None:
        _put_at_start(simulation, start)
    in_namespace = ["--ros-args", "-r", f"__ns:=/{namespace.strip('/')}"] if namespace else []
    with (
        stop_request(*STOP_SIGNALS) as stop,
        ros_node("racecar_simulator", [*context.obj, *in_namespace]) as node,
    ):
        car = SimulatorNode(node, simulation, pace=pace, teleports=teleport)
        car.start()
        spin(node, car.faults.report_failure, stop)


def _put_at_start(simulation: "DrivenSimulation", start: tuple[float, float, float]) -> None:
    """Move the car to the exact start from the free place that the simulation found nearby.

    Raises UserError when the car cannot stand there.
    """
    import math

    import numpy as np

    from racecar.maps.errors import UserError

    x, y, yaw = simulation.truth.tolist()
    try:
        if not math.dist((x, y), start[:2]) <= _NEAR or not math.isfinite(start[2]):
            raise UserError("It is too far from any place with room to drive.")
        simulation.put_at(np.array(start))
    except UserError as error:
        raise UserError(
            f"The car cannot start at {' '.join(f'{value:g}' for value in start)}; the nearest place with "
            f"room to drive is {x:.2f} {y:.2f} {yaw:.2f}: give --start a place on free floor."
        ) from error
