"""Which room of the studio fits what it is opened with."""

from collections.abc import Callable
from pathlib import Path

from racecar.maps.map_files import load_map
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import MapEdits, edits_beside
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.session_file import SESSION_FILE
from racecar.pipelines.runs.render_run import render_run
from racecar.pipelines.studio.drive.drive_room import DriveRoom
from racecar.pipelines.studio.edit.edit_room import EditRoom
from racecar.pipelines.studio.edit.saving import as_the_map_lies
from racecar.pipelines.studio.look.look_room import LookRoom
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.room import Room
from racecar.pipelines.view.run_folder import load_run

_MARKS_OF_A_RUN = ("trajectory.tum", "record")
"""Files of a run's folder of which it has one at least."""


def look_or_drive(page: Page, target: Path, settings: Config) -> Callable[[], Room]:
    """How to make the room for a run's folder, which is looked at, or for a map, on which one drives.

    Raises UserError when it is neither.
    """
    if any((target / mark).exists() for mark in _MARKS_OF_A_RUN):
        return look(page, target, settings)
    return drive(page, target, settings)


def look(page: Page, run: Path, settings: Config) -> Callable[[], Room]:
    """How to make the room in which a run is looked at. Raises UserError when it cannot be read."""
    scene = load_run(run)

    def enter_edit() -> None:
        page.tell("One moment", "The map is drawn without its edits.")
        page.enter(edit(page, run, settings))

    return lambda: LookRoom(page, scene, enter_edit if (run / SESSION_FILE).is_file() else None)


def edit(page: Page, run: Path, settings: Config) -> Callable[[], Room]:
    """How to make the room in which the map of a run is edited, and from which one goes back to the run.

    Raises UserError when there is no session to render it from, or its edits have a mistake.
    """
    edits = edits_beside(run)
    config = as_the_map_lies(run, settings.mapping)
    grid = render_run(run, config, MapEdits(), Report("racecar studio")).drawn.tiled
    return lambda: EditRoom(
        page, run, config, grid, edits, lambda: page.enter(look_or_drive(page, run, settings))
    )


def drive(page: Page, map: Path, settings: Config) -> Callable[[], Room]:
    """How to make the room in which one drives on a map. Raises UserError when it cannot be read."""
    grid = load_map(map)
    return lambda: DriveRoom(page, grid, settings.localization, settings.mapping)
