"""The input of benchmarks: recordings, and cases selected by name."""

import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, TypeAlias, TypeVar

import typer

import racecar
from racecar.maps.errors import UserError

_T = TypeVar("_T")

DataOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="DIR",
        help="Folder of the recordings. Default: $RACECAR_DATA, else ../shared/data beside the project.",
        show_default=False,
    ),
]


def recordings_folder(named: Path | None = None) -> Path:
    """The folder of recordings: as named, by RACECAR_DATA, or else ``shared/data`` beside the project."""
    beside_project = Path(racecar.__file__).parents[2] / "shared" / "data"
    return named or Path(os.environ.get("RACECAR_DATA", beside_project))


def chosen(cases: Mapping[str, _T], names: Collection[str] | None, kind: str) -> dict[str, _T]:
    """Those named, in the order of the cases, or all. Raises UserError if a name does not exist."""
    for name in names or ():
        if name not in cases:
            raise UserError(f"There is no {kind} '{name}'; there are: {', '.join(cases)}.")
    return {name: case for name, case in cases.items() if not names or name in names}
