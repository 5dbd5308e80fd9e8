"""Flags for how to draw a map, overriding the settings of a configuration, and for its optional files."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import numbers_in
from racecar.pipelines.commands.outputs import Flags

if TYPE_CHECKING:
    from racecar.mapping.config import MappingConfig

RunArgument = Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `racecar map` has written.")]

_REQUESTED = {"ply": "points.ply", "png": "map_image.png", "svg": "walls.svg", "dxf": "walls.dxf"}
"""The optional files by flag."""
_FLAGS = {
    "left_out": "--leave-out",
    "occupied_threshold": "--occupied",
    "free_threshold": "--free",
    "rendering": "--free or --occupied",
}
"""Flags whose name differs from the setting."""


@dataclass(frozen=True, kw_only=True)
class FileFlags:
    """Files of a map that are only written on request."""

    ply: Annotated[
        bool,
        typer.Option(
            "--ply",
            help="Also write points.ply, a cloud of points: from the bag of a 3D LiDAR in space.",
        ),
    ] = False
    png: Annotated[
        bool, typer.Option("--png", help="Also write map_image.png, the pixels of the map as a PNG.")
    ] = False
    svg: Annotated[
        bool, typer.Option("--svg", help="Also write walls.svg, the walls as lines at a scale of 1:100.")
    ] = False
    dxf: Annotated[
        bool, typer.Option("--dxf", help="Also write walls.dxf, the walls as lines for CAD, in metres.")
    ] = False

    @property
    def requested(self) -> tuple[str, ...]:
        """Names of the files. Raises UserError when a package they need is not installed, before any work is
        done."""
        names = tuple(name for flag, name in _REQUESTED.items() if getattr(self, flag))
        if names:
            from racecar.pipelines.runs.map_outputs import outputs_with

            outputs_with(names)
        return names


@dataclass(frozen=True, kw_only=True)
class DrawingFlags:
    """How to draw a map."""

    resolution: Annotated[
        float | None,
        typer.Option("--resolution", metavar="M", help="Side of a map cell in metres, such as 0.05."),
    ] = None
    turn: Annotated[
        str | None,
        typer.Option(
            "--turn",
            metavar="YAW|walls",
            help="Turn the map by radians, or so that its main walls run along the axes.",
        ),
    ] = None
    crop: Annotated[
        str | None,
        typer.Option(
            "--crop",
            metavar="'X Y X Y'|driven",
            help="Draw only a box of the turned map, by its least and its largest x and y in metres, "
            "or what lies within 2 m of the path.",
        ),
    ] = None
    origin: Annotated[
        str | None,
        typer.Option(
            "--origin",
            metavar="'X Y'|corner",
            help="The place of the turned map, in metres, that becomes (0, 0); or the image's lower left "
            "corner.",
        ),
    ] = None
    leave_out: Annotated[
        list[str] | None,
        typer.Option(
            "--leave-out",
            metavar="'FROM TO'",
            help="Leave out the scans between two times, in seconds since the first scan; may be repeated.",
        ),
    ] = None
    mode: Annotated[
        str | None,
        typer.Option(
            "--mode",
            metavar="MODE",
            help="What the pixels mean to map_server: trinary, scale (a PNG), or raw.",
        ),
    ] = None
    occupied: Annotated[
        float | None,
        typer.Option("--occupied", metavar="P", help="Probability from which a cell is occupied: 0.65."),
    ] = None
    free: Annotated[
        float | None,
        typer.Option("--free", metavar="P", help="Probability up to which a cell is free: 0.196."),
    ] = None

    def over(self, settings: "MappingConfig") -> "MappingConfig":
        """The settings, overridden by the flags. Raises UserError that names the flag."""
        from racecar.maps.errors import UserError
        from racecar.maps.settings import SettingsError

        given = {
            "turn": _one_or_word(self.turn),
            "crop": _numbers_or_word(self.crop),
            "origin": _numbers_or_word(self.origin),
            "left_out": [_numbers_or_word(span) for span in self.leave_out] if self.leave_out else None,
            "mode": self.mode,
            "occupied_threshold": self.occupied,
            "free_threshold": self.free,
        }
        values = settings.model_dump()
        values["rendering"].update({name: value for name, value in given.items() if value is not None})
        if self.resolution is not None:
            values["resolution"] = self.resolution
        try:
            return type(settings).model_validate(values)
        except SettingsError as error:
            name = error.name.rpartition(".")[2]
            raise UserError(f"{_FLAGS.get(name, f'--{name}')} cannot be used: {error.clause}.") from error


def map_files(flags: Flags) -> Collection[str]:
    """Names of the files that a command writes into its folder with a map."""
    from racecar.pipelines.runs.map_outputs import MAP_NAMES
    from racecar.pipelines.runs.view.recorder import RECORD_FOLDER

    asked_for = {**_REQUESTED, "record": RECORD_FOLDER}
    return {*MAP_NAMES, *(name for flag, name in asked_for.items() if flags.get(flag))}


def _numbers_or_word(text: str | None) -> list[float] | str | None:
    """The numbers, or the text if it holds anything else."""
    return None if text is None else numbers_in(text) or text


def _one_or_word(text: str | None) -> float | str | None:
    numbers = numbers_in(text or "") or ()
    return numbers[0] if len(numbers) == 1 else text
