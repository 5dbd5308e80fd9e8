"""Which room of the studio fits what it is opened with."""

from collections.abc import Callable
from pathlib import Path

from racecar.maps.map_files import load_map
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.studio.drive.drive_room import DriveRoom
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
        scene = load_run(target)
        return lambda: LookRoom(page, scene)
    return drive(page, target, settings)


def drive(page: Page, map: Path, settings: Config) -> Callable[[], Room]:
    """How to make the room in which one drives on a map. Raises UserError when it cannot be read."""
    grid = load_map(map)
    return lambda: DriveRoom(page, grid, settings.localization, settings.mapping)
