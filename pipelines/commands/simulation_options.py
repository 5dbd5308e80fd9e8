"""Flags for how a simulated car drives, made from the settings of the simulation."""

from collections.abc import Callable, Sequence
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from racecar.pipelines.simulation.simulator_config import SimulationConfig

PlanOption = Annotated[
    Path,
    typer.Option(
        "--map",
        metavar="MAP",
        help="Where to drive: a map's YAML file, a folder with map.yaml, or a built-in plan: building, "
        "track, lab_room, ring, twin_corridors, bare_corridor, long_track, campus.",
    ),
]
CAR_FLAGS = ("noise", "max_speed", "walkers", "slip", "laser", "seed")
"""Flags of every simulated car."""
DRIVE_FLAGS = (
    *(*CAR_FLAGS, "duration", "tilt", "hills", "kerbs", "posts", "carried", "carrier", "follower"),
    *("steering", "scan_every", "scan_gaps", "imu_rate"),
)
"""Flags of a recorded drive."""
_SPELT = {"max_speed": "speed", "scan_every": "every", "imu_rate": "imu"}
"""Flags whose name differs from the setting."""


def takes_settings(names: Sequence[str]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a command that takes these settings of the simulation as its last keyword arguments."""

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        own = [
            each.replace(kind=Parameter.KEYWORD_ONLY)
            for each in signature(command).parameters.values()
            if each.kind is not Parameter.VAR_KEYWORD
        ]
        flags = [*own, *map(_flag, names)]
        command.__signature__ = signature(command).replace(parameters=flags)  # type: ignore[attr-defined]
        return command

    return decorated


def _flag(name: str) -> Parameter:
    field = SimulationConfig.model_fields[name]
    bounds = {
        kind: getattr(each, kind) for each in field.metadata for kind in ("ge", "le") if hasattr(each, kind)
    }
    option = typer.Option(
        f"--{_SPELT.get(name, name).replace('_', '-')}",
        help=field.description,
        min=bounds.get("ge"),
        max=bounds.get("le"),
    )
    kind = Annotated[field.annotation, option]  # type: ignore[name-defined]
    return Parameter(name, Parameter.KEYWORD_ONLY, annotation=kind, default=field.default)
