"""Real recordings, whose truth nobody knows: the localizer beside an exhaustive match.

A scan alone may fit best elsewhere where the building has changed, people stand about or beams hit the floor;
so each is matched together with those of some seconds before and after it, laid beside one another as on the
map of the recording. That may be wrong, too: a disagreement tells where to look, not who is right. And it
searches about the localizer's pose: of one that is lost it tells that it is wrong, but not where the car is.
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from localization.localizer import Localizer
from mapping.mapper import MappingResult
from maps.map_files import load_map, save_map
from maps.occupancy_grid import OccupancyGrid
from maps.trajectory import Trajectory
from pipelines.bag_reader import BagReader
from pipelines.benchmark_accuracy_localized import LocalizedScans, localize
from pipelines.benchmark_accuracy_matcher import ExhaustiveMatcher
from pipelines.config_file import Config
from pipelines.mapping_run import build_map
from pipelines.report import Report

_EVERY = 50
_AGREES = 0.15
"""Metres."""
_AS_GOOD = 0.02
"""Of the fit (0 to 1), that a pose may have less and still fit as well."""


@dataclass(frozen=True)
class Recording:
    """A bag and the map to find it on."""

    bag: Path
    map: Path | None
    """None: the one that is made of the bag."""


@dataclass(frozen=True)
class Comparison:
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

    @property
    def is_clear(self) -> bool:
        """Whether the scan clearly fits worse where the localizer says."""
        return self.gain > _AS_GOOD


@dataclass(frozen=True)
class RecordingFigures:
    """How far the localizer was from where its scans fit best."""

    scans_compared: int
    mean_m: float
    """Over the scans that agree to 0.15 m; nan when none does."""
    largest_m: float
    """Over the same."""
    beyond: list[Comparison]
    """The scans that fit clearly better more than 0.15 m away."""
    undecided: list[Comparison]
    """Those that fit best more than 0.15 m away, but about as well where the localizer says."""
    searches: int
    """How often the place was searched for: at the start, after gaps and when the car seemed lost."""


def find_recordings(folder: Path) -> dict[str, Recording]:
    """The recordings there are in a folder, by name."""
    home = folder / "racecar"
    basement = home / "maps" / "stata_basement.yaml"
    known = {
        "session_A on stata_basement": Recording(home / "session_A", basement),
        "localization_bag1 on stata_basement": Recording(home / "localization_bag1.bag", basement),
        "session_A on our own map": Recording(home / "session_A", None),
    }
    return {
        name: recording
        for name, recording in known.items()
        if recording.bag.exists() and (recording.map is None or recording.map.exists())
    }


def measure_recordings(
    folder: Path, settings: Config, announce: Callable[[str], None]
) -> dict[str, RecordingFigures]:
    """All the recordings there are in a folder, by name."""
    figures = {}
    for name, recording in find_recordings(folder).items():
        announce(f"Recording: {name}")
        figures[name] = measure_recording(recording, settings, seed=0)
    return figures


def measure_recording(recording: Recording, settings: Config, seed: int) -> RecordingFigures:
    """Localize a recording from anywhere on the map, and match the stretch about every 50th scan."""
    own = _mapped(recording.bag, settings)
    grid = _as_read(own.grid) if recording.map is None else load_map(recording.map)
    localizer = Localizer(grid, settings.localization, np.random.default_rng(seed))
    with BagReader(recording.bag) as reader:
        localized = localize(reader, localizer)
    comparisons = compare_scans(localized, own.trajectory, ExhaustiveMatcher(grid))
    return recording_figures(comparisons, localized.searches)


def compare_scans(
    localized: LocalizedScans, own_trajectory: Trajectory, matcher: ExhaustiveMatcher, every: int = _EVERY
) -> list[Comparison]:
    """Every so manieth scan by the localizer and by an exhaustive match of the stretch about it."""
    comparisons = []
    for index in range(every - 1, len(localized.scans), every):
        map_from_base = localized.map_from_base[index]
        best, gain = matcher.match(localized.stretch_about(index, own_trajectory), map_from_base)
        metres = float(np.hypot(*(best - map_from_base)[:2]))
        comparisons.append(Comparison(index + 1, metres, gain))
    return comparisons


def _mapped(bag: Path, settings: Config) -> MappingResult:
    with BagReader(bag) as reader:
        return build_map(reader, settings.mapping, Report("racecar map"), quiet=True)


def _as_read(grid: OccupancyGrid) -> OccupancyGrid:
    """As whoever reads the map's files sees it."""
    with tempfile.TemporaryDirectory() as folder:
        save_map(grid, Path(folder) / "map.yaml")
        return load_map(Path(folder))


def recording_figures(comparisons: list[Comparison], searches: int) -> RecordingFigures:
    """Sort the scans into those that agree and those that do not."""
    agreeing = np.array([each.metres for each in comparisons if each.agrees] or [np.nan])
    return RecordingFigures(
        scans_compared=len(comparisons),
        mean_m=float(agreeing.mean()),
        largest_m=float(agreeing.max()),
        beyond=[each for each in comparisons if not each.agrees and each.is_clear],
        undecided=[each for each in comparisons if not each.agrees and not each.is_clear],
        searches=searches,
    )
