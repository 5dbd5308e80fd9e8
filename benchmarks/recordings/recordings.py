"""Real recordings, whose truth nobody knows: the localizer beside an exhaustive match.

A scan alone may fit best elsewhere where the building has changed, people stand around or beams hit floors;
together with those before and after it, laid beside one another as on the recording's own map, where the two
maps differ. So each is matched alone and in shorter and longer segments, and of these matches the one counts
that the others agree with best. A disagreement shows where to look, not who is right. And a match searches
near the localizer's pose: of a localizer that is lost it shows that it is wrong, but not where the car is.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from benchmarks.harness.table import Column
from benchmarks.recordings.exhaustive_matcher import ExhaustiveMatcher
from benchmarks.recordings.localized_scans import LocalizedScans, localize
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map, save_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext

EVERY = 50
"""Scans for each one that is matched, as an exhaustive match takes seconds."""
_REACHES = (0, 40, 80, 160, 240)
"""Scans before and after one that are matched together with it; there are 40 a second."""
_AGREES = 0.15
"""Metres between two poses that count as the same place: three cells of a map of 5 cm, by judgement."""


@dataclass(frozen=True)
class RecordedDrive:
    """A bag and the map to find it on."""

    bag: Path
    map: Path | None
    """None: the one that is made of the bag."""


@dataclass(frozen=True)
class ScanComparison:
    """One scan, by the localizer and by an exhaustive match."""

    scan: int
    """Counted from 1."""
    metres: float
    """From the localizer's pose to the best fitting one."""
    gain: float
    """By how much better a fit (0 to 1) that is."""

    @property
    def agrees(self) -> bool:
        """Whether the two poses are the same place."""
        return self.metres <= _AGREES


@dataclass(frozen=True)
class RecordingFigures:
    """How far the localizer was from where its scans fit best."""

    scans_compared: Annotated[int, Column("scans compared")]
    mean_m: Annotated[float, Column("mean (m)", ".3f")]
    """Over the scans that agree to 0.15 m; nan when none does."""
    largest_m: Annotated[float, Column("largest (m)", ".3f")]
    """Over the same."""
    scans_beyond: Annotated[int, Column("beyond 0.15 m")]
    searches: Annotated[int, Column("searches")]
    """How often the place was searched for: at the start, after gaps and when the car seemed lost."""
    beyond: list[ScanComparison]
    """The scans that fit best more than 0.15 m away."""


def find_recordings(folder: Path) -> dict[str, RecordedDrive]:
    """The recordings there are in a folder, by name."""
    home = folder / "racecar"
    basement = home / "maps" / "stata_basement.yaml"
    known = {
        "session_A on stata_basement": RecordedDrive(home / "session_A", basement),
        "localization_bag1 on stata_basement": RecordedDrive(home / "localization_bag1.bag", basement),
        "session_A on our own map": RecordedDrive(home / "session_A", None),
    }
    return {
        name: recording
        for name, recording in known.items()
        if recording.bag.exists() and (recording.map is None or recording.map.exists())
    }


def match_recording(recording: RecordedDrive, settings: Config, seed: int = 0) -> RecordingFigures:
    """Localize a recording from anywhere on the map, and match every 50th scan."""
    with BagReader(recording.bag) as reader:
        own = build_map(reader, settings, RunContext(), learns_sensors=False)
    grid = as_read(own.grid) if recording.map is None else load_map(recording.map)
    localizer = Localizer(grid, settings.localization, np.random.default_rng(seed))
    with BagReader(recording.bag) as reader:
        localized = localize(reader, localizer)
    comparisons = compare_scans(localized, own.trajectory, ExhaustiveMatcher(grid))
    return recording_figures(comparisons, localized.searches)


def compare_scans(
    localized: LocalizedScans, own_trajectory: Trajectory, matcher: ExhaustiveMatcher, every: int = EVERY
) -> list[ScanComparison]:
    """One scan in ``every`` by the localizer and by an exhaustive match, alone and with its neighbours."""
    comparisons = []
    for index in range(every - 1, len(localized.scans), every):
        best, gain = best_match(localized, index, own_trajectory, matcher)
        off = best - localized.map_from_base[index]
        comparisons.append(ScanComparison(index + 1, float(np.hypot(*off[:2])), gain))
    return comparisons


def best_match(
    localized: LocalizedScans, index: int, own_trajectory: Trajectory, matcher: ExhaustiveMatcher
) -> tuple[Pose, float]:
    """The pose (3,) where a scan fits best by an exhaustive match about the localizer's, and by how much.

    It is matched alone and with its neighbours; of these matches it is the one that the others agree with.
    """
    map_from_base = localized.map_from_base[index]
    segments = [localized.segment_about(index, own_trajectory, reach) for reach in _REACHES]
    matches = [matcher.match(segment, map_from_base) for segment in segments]
    return matches[_agreed([pose for pose, _ in matches])]


def _agreed(poses: list[Pose]) -> int:
    """Which of the poses (3,) has the others nearest: their medoid, which no outlier draws aside."""
    places = np.array(poses)[:, :2]
    return int(np.argmin(np.linalg.norm(places[:, None] - places, axis=2).sum(axis=1)))


def as_read(grid: OccupancyGrid) -> OccupancyGrid:
    """As whoever reads the map's files sees it."""
    with tempfile.TemporaryDirectory() as folder:
        save_map(grid, Path(folder) / "map.yaml")
        return load_map(Path(folder))


def recording_figures(comparisons: list[ScanComparison], searches: int) -> RecordingFigures:
    """Sort the scans into those that agree and those that do not."""
    agreeing = np.array([each.metres for each in comparisons if each.agrees] or [np.nan])
    beyond = [each for each in comparisons if not each.agrees]
    return RecordingFigures(
        scans_compared=len(comparisons),
        mean_m=float(agreeing.mean()),
        largest_m=float(agreeing.max()),
        scans_beyond=len(beyond),
        searches=searches,
        beyond=beyond,
    )
