"""The map so far, saved while the car drives: however the node ends, there is a map."""

import time
from threading import Lock

import numpy as np

from racecar.mapping.grid.rendering import pixels_of
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import save_map
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_folders import remove_with
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.files.session_file import SESSION_FILE, save_session
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.saving.map_saving import MapOutput
from racecar.pipelines.runs.map_outputs import MAP_NAMES

_EVERY = 30.0
"""Seconds between two saves. Chosen by judgement: no more of a map is missed when a battery is empty."""
_LEAST_REST = 100.0
"""Minimum pause per time that saving takes, which grows with the map: 1 % of a core, because mapping comes
first."""


class UnfinishedMap:
    """Saves the map as it is displayed, without the final optimization: now and then, and when asked to."""

    def __init__(self, output: MapOutput, faults: Faults) -> None:
        self._output, self._faults = output, faults
        self._latest: tuple[Session, OccupancyGrid] | None = None
        """Not saved yet."""
        self._due = 0.0
        self._lock = Lock()
        self._most_before = 0
        """Keyframes of the longest drive before."""

    def show(self, session: Session, grid: OccupancyGrid) -> None:
        """Take note of the latest map, and save it if that is due."""
        if len(session.keyframes) > self._most_before and session.keyframes.is_kept.any():
            self._latest = session, grid
            if time.monotonic() >= self._due:
                self.save()

    def leave_longer(self, keyframes: int) -> None:
        """Do not replace the map of an earlier drive of this many ``keyframes`` by that of a shorter one."""
        self._most_before = max(self._most_before, keyframes)

    def leave_finished(self) -> None:
        """Until the drive ends, do not replace a finished map that was saved meanwhile."""
        self._due = np.inf

    def save(self) -> None:
        """Save the latest map unless it is saved; an error is reported."""
        with self._lock:
            latest, self._latest = self._latest, None
            if latest is None:
                return
            began = time.monotonic()
            try:
                self._write(*latest)
                self._faults.end("unfinished map", "The map so far is saved again.")
            except (UserError, OSError) as error:
                self._faults.report("unfinished map", f"The map so far was not saved: {error}")
            now = time.monotonic()
            self._due = max(self._due, now + max(_EVERY, _LEAST_REST * (now - began)))

    def _write(self, session: Session, grid: OccupancyGrid) -> None:
        report, folder = self._output.new_report(), self._output.folder
        caution = (
            "The map is not finished: it is what the node showed while driving. If the node was ended since, "
            f"`racecar live map --out {folder}` goes on with the drive within an hour, and finishes it."
        )
        report.add("counts", {"keyframes": len(session.keyframes), "interrupted": True})
        report.add("quality", {"verdict": "doubtful", "reasons": [caution]})
        report.warn(caution)
        with output_folder(folder) as staging:
            save_map(grid, staging / "map.yaml", **pixels_of(self._output.config.mapping.rendering))
            save_tum(Trajectory(session.times.stamps, session.map_from_base), staging / "trajectory.tum")
            save_session(session, staging / SESSION_FILE)
            report.write(staging / REPORT_FILE)
            for name in set(MAP_NAMES).difference(path.name for path in staging.iterdir()):
                remove_with(staging / name)
