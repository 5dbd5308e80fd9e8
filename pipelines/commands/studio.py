"""``racecar studio``: everything on one page in the browser."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import ConfigOption, QuietOption
from racecar.pipelines.commands.page_options import PageFlags

if TYPE_CHECKING:
    from racecar.pipelines.studio.page import Page
    from racecar.pipelines.studio.screen import Screen


def studio(
    *,
    target: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR | BAG | MAP",
            help="A folder that `racecar map` or `racecar localize` has written, to look at; a bag or a "
            "folder of bags, to map; or a map to drive on. By default the shipped map of a building.",
        ),
    ] = None,
    map: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="Drive on this map: a YAML file, a folder with map.yaml, or a shipped map: building, track.",
        ),
    ] = None,
    served: PageFlags,
    config: ConfigOption = None,
    quiet: QuietOption = False,
) -> None:
    """Look at a run, map a bag, or drive a simulated car by clicks, on a page in the browser.

    A run: map, path, keyframes and loop closures over time, and every scan and the particles if it was made
    with --record; its map can be edited by clicks. A bag: it is checked and mapped, and you watch the map
    grow. A map: the car drives to where you click, and the localizer follows it, or the mapper discovers the
    floor. The page is served to this machine only, and needs no network. Ctrl-C ends it.

    Example: racecar studio runs/drive

    To map: racecar studio drive.bag

    To drive: racecar studio --map building
    """
    from racecar.maps.errors import UserError
    from racecar.pipelines.commands.terminal import teller
    from racecar.pipelines.files.config_file import load_config

    if target is not None and map is not None:
        raise UserError("Give a run to look at or --map to drive on, and not both.")
    settings = load_config(config)

    from racecar.pipelines.studio.studio import drive, screen_for

    def prepare(page: "Page") -> "Callable[[], Screen]":
        if target is not None:
            return screen_for(page, target, settings)
        return drive(page, map or Path("building"), settings)

    served.serve(prepare, settings, teller(quiet=quiet))
