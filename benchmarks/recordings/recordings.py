"""Real recordings without a known truth: the localizer compared with an exhaustive match.

A single scan may fit best elsewhere if the building has changed, people stand around or beams hit the floor.
So may a segment of scans, joined as on the recording's own map, where the two maps differ. So each scan is
matched alone and in shorter and longer segments, and the match that agrees best with the others counts. A
disagreement shows where to look, not which one is right. A match searches near the localizer's pose: it shows
that a lost localizer is wrong, but not where the car is.
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
"""One in this many scans is matched, as an exhaustive match takes seconds."""
_REACHES = (0, 40, 80, 160, 240)
"""Scans before and after a scan that are matched together with it; there are 40 a second."""
_AGREES = 0.15
"""Metres between two poses that count as the same place. Chosen by judgement: three cells of a 5 cm map."""


@dataclass(frozen=True)
class RecordedDrive:
    """A bag and the map to localize it on."""

    bag: Path
    map: Path | None
    """None: the map made from the bag."""


@dataclass(frozen=True)
class ScanComparison:
    """A scan as placed by the localizer and by an exhaustive match."""

    scan: int
    """Counted from 1."""
    metres: float
    """From the localizer's pose to the best-fitting one."""
    gain: float
    """Gain in fit (0 to 1) of that pose."""

    @property
    def agrees(self) -> bool:
        """Whether the two poses are the same place."""
        return self.metres <= _AGREES


@dataclass(frozen=True)
class RecordingFigures:
    """Distance of the localizer's poses from those where its scans fit best."""

    scans_compared: Annotated[int, Column("scans compared")]
    mean_m: Annotated[float, Column("mean (m)", ".3f")]
    """Over the scans that agree to 0.15 m; nan if none does."""
    largest_m: Annotated[float, Column("largest (m)", ".3f")]
    """Over the same scans."""
    scans_beyond: Annotated[int, Column("beyond 0.15 m")]
    searches: Annotated[int, Column("searches")]
    """Number of place searches: at the start, after gaps and when the car seemed lost."""
    beyond: list[ScanComparison]
    """The scans that fit best more than 0.15 m away."""


def find_recordings(folder: Path) -> dict[str, RecordedDrive]:
    """The recordings found in a folder, by name."""
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
    """Compare one in ``every`` scans with an exhaustive match, alone and with its neighbours."""
    comparisons = []
    for index in range(every - 1, len(localized.scans), every):
        best, gain = best_match(localized, index, own_trajectory, matcher)
        off = best - localized.map_from_base[index]
        comparisons.append(ScanComparison(index + 1, float(np.hypot(*off[:2])), gain))
    return comparisons


def best_match(
    localized: LocalizedScans, index: int, own_trajectory: Trajectory, matcher: ExhaustiveMatcher
) -> tuple[Pose, float]:
    """The pose (3,) around the localizer's that fits a scan best in an exhaustive match, and its gain.

    It is matched alone and with its neighbours; the match that agrees best with the others is returned.
    """
    map_from_base = localized.map_from_base[index]
    segments = [localized.segment_about(index, own_trajectory, reach) for reach in _REACHES]
    matches = [matcher.match(segment, map_from_base) for segment in segments]
    return matches[_agreed([pose for pose, _ in matches])]


def _agreed(poses: list[Pose]) -> int:
    """Index of the medoid of the poses (3,), which is robust to outliers."""
    places = np.array(poses)[:, :2]
    return int(np.argmin(np.linalg.norm(places[:, None] - places, axis=2).sum(axis=1)))


def as_read(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid as read back from the map's files."""
    with tempfile.TemporaryDirectory() as folder:
        save_map(grid, Path(folder) / "map.yaml")
        return load_map(Path(folder))


def recording_figures(comparisons: list[ScanComparison], searches: int) -> RecordingFigures:
    """Divide the scans into those that agree and those that do not."""
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
