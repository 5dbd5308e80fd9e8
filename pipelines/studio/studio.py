"""Which room of the studio fits what it is opened with."""

from collections.abc import Callable
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.studio.look.look_room import LookRoom
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.room import Room
from racecar.pipelines.view.run_folder import load_run

_MARKS_OF_A_RUN = ("trajectory.tum", "record")
"""Files of a run's folder of which it has one at least."""


def room_for(page: Page, target: Path) -> Callable[[], Room]:
    """How to make the room for a run's folder. Raises UserError when it is none."""
    if not any((target / mark).exists() for mark in _MARKS_OF_A_RUN):
        raise UserError(
            f"{target} is no run; name a folder that `racecar map` or `racecar localize` has written."
        )
    scene = load_run(target)
    return lambda: LookRoom(page, scene)
