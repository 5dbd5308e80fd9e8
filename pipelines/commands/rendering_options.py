"""The flags that say how a map is drawn, over the settings of a configuration."""

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.outputs import Flags

if TYPE_CHECKING:
    from racecar.mapping.config import MappingConfig

RunArgument = Annotated[
    Path,
    typer.Argument(metavar="DIR", help="A folder that `racecar map` has written.", show_default=False),
]
ResolutionOption = Annotated[
    float | None,
    typer.Option(
        "--resolution", metavar="M", help="Side of a map cell in metres, such as 0.05.", show_default=False
    ),
]
TurnOption = Annotated[
    str | None,
    typer.Option(
        "--turn",
        metavar="YAW|walls",
        help="Turn the map by radians, or so that its main walls run along the axes.",
        show_default=False,
    ),
]
CropOption = Annotated[
    str | None,
    typer.Option(
        "--crop",
        metavar="'X Y X Y'|driven",
        help="Draw only a box of the turned map, by its least and its largest x and y in metres, "
        "or what lies within 2 m of the path.",
        show_default=False,
    ),
]
OriginOption = Annotated[
    str | None,
    typer.Option(
        "--origin",
        metavar="'X Y'|corner",
        help="The place of the turned map, in metres, that becomes (0, 0); or the image's lower left corner.",
        show_default=False,
    ),
]
LeaveOutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--leave-out",
        metavar="'FROM TO'",
        help="Leave out the scans between two times, in seconds since the first scan; may be repeated.",
        show_default=False,
    ),
]
ModeOption = Annotated[
    str | None,
    typer.Option(
        "--mode",
        metavar="MODE",
        help="What the pixels mean to map_server: trinary, scale (a PNG), or raw.",
        show_default=False,
    ),
]
OccupiedOption = Annotated[
    float | None,
    typer.Option(
        "--occupied", metavar="P", help="Probability from which a cell is occupied: 0.65.", show_default=False
    ),
]
FreeOption = Annotated[
    float | None,
    typer.Option(
        "--free", metavar="P", help="Probability up to which a cell is free: 0.196.", show_default=False
    ),
]
PlyOption = Annotated[
    bool, typer.Option("--ply", help="Also write points.ply, the map as a cloud of points.")
]
PngOption = Annotated[
    bool, typer.Option("--png", help="Also write map_image.png, the pixels of the map as a PNG.")
]
SvgOption = Annotated[
    bool, typer.Option("--svg", help="Also write walls.svg, the walls as lines at a scale of 1:100.")
]
DxfOption = Annotated[
    bool, typer.Option("--dxf", help="Also write walls.dxf, the walls as lines for CAD, in metres.")
]

_REQUESTED = {"ply": "points.ply", "png": "map_image.png", "svg": "walls.svg", "dxf": "walls.dxf"}
"""The files that flags ask for."""


def map_files(flags: Flags) -> Collection[str]:
    """The names of what a command that makes a map writes into its folder."""
    from racecar.pipelines.runs.map_outputs import MAP_FILES
    from racecar.pipelines.view.recorder import RECORD_FOLDER

    asked_for = {**_REQUESTED, "record": RECORD_FOLDER}
    return {*MAP_FILES, *(name for flag, name in asked_for.items() if flags.get(flag))}


_FLAGS = {
    "resolution": "--resolution",
    "turn": "--turn",
    "crop": "--crop",
    "origin": "--origin",
    "left_out": "--leave-out",
    "mode": "--mode",
    "occupied_threshold": "--occupied",
    "free_threshold": "--free",
}


def requested_files(*, ply: bool, png: bool, svg: bool, dxf: bool) -> tuple[str, ...]:
    """The files that flags ask for."""
    wanted = {"ply": ply, "png": png, "svg": svg, "dxf": dxf}
    return tuple(name for flag, name in _REQUESTED.items() if wanted[flag])


def drawn_as(
    settings: "MappingConfig",
    *,
    resolution: float | None,
    turn: str | None,
    crop: str | None,
    origin: str | None,
    leave_out: list[str] | None,
    mode: str | None,
    occupied: float | None,
    free: float | None,
) -> "MappingConfig":
    """The settings with those that flags give in place of theirs. Raises UserError that names the flag."""
    from pydantic import ValidationError

    from racecar.maps.errors import UserError

    given = {
        "turn": _number_or_word(turn),
        "crop": _numbers_or_word(crop),
        "origin": _numbers_or_word(origin),
        "left_out": [_numbers_or_word(span) for span in leave_out] if leave_out else None,
        "mode": mode,
        "occupied_threshold": occupied,
        "free_threshold": free,
    }
    values = settings.model_dump()
    values["rendering"].update({name: value for name, value in given.items() if value is not None})
    if resolution is not None:
        values["resolution"] = resolution
    try:
        return type(settings).model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        flag = _FLAGS.get(str(first["loc"][-1]), "--free or --occupied")
        reason = first["msg"].removeprefix("Value error, ")
        raise UserError(f"{flag} cannot be used: {reason[:1].lower()}{reason[1:]}.") from error


def _number_or_word(text: str | None) -> float | str | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _numbers_or_word(text: str | None) -> list[float] | str | None:
    """Numbers with blanks or commas between them; the text where it is something else."""
    try:
        return None if text is None else [float(number) for number in text.replace(",", " ").split()]
    except ValueError:
        return text
