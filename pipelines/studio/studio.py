"""Choose the screen of the studio that fits its argument."""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_names
from racecar.maps.whole_folders import finish_replacing
from racecar.pipelines.bags.storage.recordings import is_bag_file
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import edits_beside
from racecar.pipelines.files.session_file import SESSION_FILE, load_session
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.runs.batch.bag_search import find_bags
from racecar.pipelines.runs.render_run import render_run
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.view.run_folder import load_run
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.studio.drive.drive_screen import DriveScreen
from racecar.pipelines.studio.edit.edit_screen import EditScreen
from racecar.pipelines.studio.edit.saving import as_the_map_lies
from racecar.pipelines.studio.look.look_screen import LookScreen
from racecar.pipelines.studio.map_bag.map_bag_screen import MapBagScreen
from racecar.pipelines.studio.mend.mend_screen import MendScreen
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Screen

_MARKS_OF_A_RUN = ("trajectory.tum", "record")
"""Files in a run's folder, at least one of which exists."""
_RUNS = Path("runs")
"""The default folder for maps; bags in it are recordings of runs."""


def screen_for(page: Page, target: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for ``target``: to look at a run's folder, to drive on a map, or to map a bag
    or one of a folder of bags.

    Raises UserError when it is none of these, or cannot be read.
    """
    finish_replacing(target)
    if any((target / mark).exists() for mark in _MARKS_OF_A_RUN):
        return look(page, target, settings)
    if _is_map(target):
        return drive(page, target, settings)
    if not target.exists():
        raise UserError(
            f"There is no {target}: name a run's folder to look at, a bag to map, or a map to drive on, such "
            f"as {' or '.join(shipped_names())}, which come with it."
        )
    return map_bag(page, target, settings)


def add_opening(page: Page, settings: Config) -> None:
    """Add a section to the side panel of every screen for opening something else."""
    with page.gui.add_folder("Open something else", order=1e5, expand_by_default=False):
        page.gui.add_markdown("A run's folder, a bag, a folder of bags, or a map.")
        path = page.gui.add_text("Path", "building")
        page.on_press(
            page.gui.add_button("Open"),
            lambda: page.leave_for(partial(_screen_named, page, path.value, settings)),
        )


def look(page: Page, run: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for looking at a run. Raises UserError when the run cannot be read."""
    scene = load_run(run)

    def enter_edit() -> None:
        page.tell("One moment", "The map is drawn without its edits.")
        page.enter(edit(page, run, settings))

    has_session = (run / SESSION_FILE).is_file()
    return lambda: LookScreen(
        page,
        scene,
        edit=enter_edit if has_session else None,
        mend=(lambda: page.enter(mend(page, run, settings))) if has_session else None,
        drive=(lambda: page.enter(drive(page, run, settings))) if _is_map(run) else None,
    )


def edit(page: Page, run: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for editing the map of a run, which leads back to the run.

    Raises UserError when there is no session to render it from, or its edits have a mistake.
    """
    edits = edits_beside(run)
    config = as_the_map_lies(run, settings.mapping)
    grid = render_run(run, config, RunContext()).result.tiled
    go_back = partial(page.leave_for, partial(screen_for, page, run, settings))
    return lambda: EditScreen(page, run, config, grid, edits, go_back)


def mend(page: Page, run: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for correcting the map of a run by hand, which leads back to the run.

    Raises UserError when it has no session, or its edits have a mistake.
    """
    session, edits = load_session(run), edits_beside(run)
    config = as_the_map_lies(run, settings.mapping)
    grid = load_map(run) if (run / "map.yaml").is_file() else None
    go_back = partial(page.leave_for, partial(screen_for, page, run, settings))

    def reopen() -> None:
        page.enter(mend(page, run, settings))

    return lambda: MendScreen(page, run, config, session, edits, grid, reopen=reopen, leave=go_back)


def drive(page: Page, map: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for driving on a map. Raises UserError when the map cannot be read, or has no
    place for the car."""
    grid = load_map(map)
    simulation = DrivenSimulation(grid, Conditions())
    return lambda: DriveScreen(page, grid, simulation, settings.localization, settings.mapping)


def map_bag(page: Page, source: Path, settings: Config) -> Callable[[], Screen]:
    """A factory of the screen for mapping a bag, or one of those in a folder. Raises UserError when there is
    none."""
    if source.is_file() and not is_bag_file(source):
        raise UserError(f"{source} is neither a bag nor a map; of a run, name the folder.")
    try:
        bags = find_bags(source, _RUNS)
    except UserError as error:
        raise UserError(f"{error} It is no run's folder and no map, either.") from error
    home = os.path.commonpath([bag.parent for bag in bags])
    names = {str(bag.relative_to(home)): bag for bag in bags}

    def open_run(run: Path) -> None:
        page.enter(look(page, run, settings))

    return lambda: MapBagScreen(page, names, settings, open_run)


def _screen_named(page: Page, name: str, settings: Config) -> Callable[[], Screen]:
    """The screen for a name that the user has typed."""
    return screen_for(page, typed_path(name), settings)


def _is_map(target: Path) -> bool:
    return (
        target.suffix in (".yaml", ".yml")
        or (target / "map.yaml").is_file()
        or str(target) in shipped_names()
    )
