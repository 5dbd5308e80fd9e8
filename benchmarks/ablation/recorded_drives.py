"""The recordings of the ablation, each with the best known poses of its scans.

On a map made from the recording itself these are the mapper's trajectory. On another map there is no truth,
so every 50th scan is matched exhaustively around the pose estimated by the localizer with everything on.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from itertools import takewhile
from pathlib import Path

import numpy as np

from benchmarks.ablation.ablation_drive import AblationDrive
from benchmarks.recordings.exhaustive_matcher import ExhaustiveMatcher
from benchmarks.recordings.localized_scans import localize
from benchmarks.recordings.recordings import (
    EVERY,
    RecordedDrive,
    as_read,
    best_match,
    find_recordings,
)
from benchmarks.slam.logs import find_logs
from racecar.localization.localizer import Localizer
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.sensors.measurement import Measurement


def recorded_drives(
    folder: Path, settings: Config, seconds: float | None
) -> dict[str, Callable[[int], AblationDrive]]:
    """The recordings in a folder by name, all or the first seconds of each; the seed is the localizer's."""
    return {name: _loaded_once(each, settings, seconds) for name, each in _found(folder).items()}


def _found(folder: Path) -> dict[str, RecordedDrive]:
    strangers = folder / "strangers"
    turtlebot, hall = strangers / "turtlebot4_rplidar", strangers / "sick_hall"
    found = find_recordings(folder)
    for floor in (turtlebot / "map").glob("*.yaml"):
        found["turtlebot4_rplidar on its team's map"] = RecordedDrive(turtlebot, floor)
    if hall.exists():
        found["sick_hall on our own map"] = RecordedDrive(hall, None)
    with suppress(UserError):  # a folder without logs
        found |= {f"{log.name} on our own map": RecordedDrive(log.bag, None) for log in find_logs(folder)}
    return found


def _loaded_once(
    recording: RecordedDrive, settings: Config, seconds: float | None
) -> Callable[[int], AblationDrive]:
    load = cache(lambda: _load(recording, settings, seconds))
    return lambda seed: load()


def _load(recording: RecordedDrive, settings: Config, seconds: float | None) -> AblationDrive:
    with BagReader(recording.bag) as reader:
        own = build_map(reader, settings, RunContext())
        end = np.inf if seconds is None else float(own.trajectory.stamps[0]) + seconds * 1e9
        messages = list(takewhile(lambda message: message.stamp < end, reader))
    if recording.map is None:
        driven = own.trajectory
        known = driven.stamps < end
        truth = Trajectory(driven.stamps[known], driven.map_from_base[known])
        return AblationDrive(as_read(own.grid), messages, truth, truth.map_from_base[0])
    grid = load_map(recording.map)
    return AblationDrive(grid, messages, _matched(grid, messages, own.trajectory, settings), None)


def _matched(
    grid: OccupancyGrid, messages: list[Measurement], own_trajectory: Trajectory, settings: Config
) -> Trajectory:
    """The best-fitting poses of every 50th scan on a map from other recordings."""
    localized = localize(messages, Localizer(grid, settings.localization, np.random.default_rng(0)))
    matcher = ExhaustiveMatcher(grid)
    indices = range(min(EVERY, len(localized.scans)) - 1, len(localized.scans), EVERY)
    poses = [best_match(localized, index, own_trajectory, matcher)[0] for index in indices]
    return Trajectory(np.array([localized.scans[index].stamp for index in indices]), np.array(poses))
