"""The flags that say how a simulated car drives, and what its sensors are like."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import SeedOption
from racecar.pipelines.simulation.simulator_config import LaserKind, NoiseLevel

PlanOption = Annotated[
    Path,
    typer.Option(
        "--map",
        metavar="MAP",
        help="Where to drive: a map's YAML file, a folder with map.yaml, or a built-in plan: building, "
        "track, twin_corridors, bare_corridor, long_track, campus.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class CarFlags:
    """A car in a world; named as in SimulationConfig."""

    noise: Annotated[NoiseLevel, typer.Option("--noise", help="Noise of the wheel odometry.")] = (
        NoiseLevel.SLIGHT
    )
    max_speed: Annotated[
        float, typer.Option("--speed", metavar="M/S", min=0.3, max=15.0, help="Top speed; bends are slower.")
    ] = 2.0
    walkers: Annotated[
        int, typer.Option("--walkers", metavar="N", min=0, max=100, help="Number of people walking about.")
    ] = 0
    slip: Annotated[
        float,
        typer.Option("--slip", metavar="SHARE", min=0.0, max=0.99, help="Wheel slip at full acceleration."),
    ] = 0.0
    laser: Annotated[
        LaserKind,
        typer.Option(
            "--laser",
            help="race: 270°, 30 m, 40 Hz; short: 240°, 4 m, 10 Hz, half of the beams empty; round: 360°, "
            "12 m, 7 Hz; outdoor: 180°, 80 m, 10 Hz, most distant returns missed.",
        ),
    ] = LaserKind.RACE
    seed: SeedOption = 0
