"""Maps of known error, and what the verdict says of them."""

import random
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.quality.known_drives import KnownDrive
from benchmarks.quality.map_errors import MapErrors, map_errors
from benchmarks.quality.spoiled_maps import SPOILINGS, UNSPOILED
from benchmarks.replacements import replaced
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.moving_along.moving_along import MovingAlong
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.quality.statistics import LOCAL_DISTANCE
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose
from racecar.pipelines.bags.replay import feed

NEAR = 10.0
"""Metres between a place that was named and the worst error, within which it was found; by judgement: it is
in view."""
_SHORTEST = 1.0
"""Metres of path, below which there is no map to speak of; by judgement."""


@dataclass(frozen=True)
class JudgedMap:
    """A map, its errors and the verdict on it."""

    drive: str
    spoiling: str
    errors: MapErrors
    verdict: str
    expected_local_m: float
    expected_whole_m: float
    place_off_m: float | None
    """From the worst error to the nearest segment that was named; None where none was."""
    near_share: float
    """Share of all keyframes that lie within `NEAR` of a segment that was named."""
    judging_seconds: float
    statistics: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return asdict(self)


def judged_maps(drive: KnownDrive, spoilings: int, base: MappingConfig) -> Iterator[JudgedMap]:
    """A drive mapped as it is, and made worse in some of the ways there are, which its name draws."""
    others = [name for name in SPOILINGS if name != UNSPOILED]
    for name in [UNSPOILED, *random.Random(drive.name).sample(others, spoilings)]:
        try:
            result = spoiled_map(drive, name, base)
        except UserError:
            continue  # no map at all is an honest answer
        judged = judged_map(drive, name, result)
        if judged is not None:
            yield judged


def spoiled_map(drive: KnownDrive, spoiling: str, base: MappingConfig) -> MappingResult:
    """Map a drive that was made worse. Raises UserError when nothing is left to map."""
    how = SPOILINGS[spoiling]
    mapper = Mapper(MappingConfig.model_validate({**base.model_dump(), "refine": False, **how.settings}))
    with replaced(how.replacements):
        for message in MovingAlong().filtered(how.of(drive.messages)):
            feed(message, mapper)
        return mapper.finish()


def judged_map(drive: KnownDrive, spoiling: str, result: MappingResult) -> JudgedMap | None:
    """Compare a verdict with the truth; None where too little of the path is known."""
    stamps = result.trajectory.stamps[result.keyframe_indices]
    known = np.flatnonzero(drive.is_known(stamps))
    if len(known) < 2:
        return None
    # A wrong mount moves the car in the map, and leaves the map itself as it is.
    true = compose(drive.truth.poses_at(stamps[known]), drive.mount)
    lasers = result.session.map_from_keyframe
    errors = map_errors(lasers[known], true, LOCAL_DISTANCE)
    if errors.path_m < _SHORTEST:
        return None
    first, last = known[list(errors.worst)]
    off = _off_named(result.quality, lasers)
    return JudgedMap(
        drive.name,
        spoiling,
        errors,
        result.quality.verdict.value,
        result.quality.error_per_10_m,
        result.quality.error_of_whole,
        float(off[first : last + 1].min()) if result.quality.segments else None,
        float(np.mean(off < NEAR)),
        result.seconds["judging"],
        result.quality.statistics,
    )


def _off_named(quality: MapQuality, lasers: Pose) -> NDArray[np.float64]:
    """(K,) metres from each of the lasers' poses (K, 3) to the path of the segments that are named; infinite
    where none is."""
    runs = [run for s in quality.segments for run in (s.keyframes, s.contradicted_by) if run is not None]
    if not runs:
        return np.full(len(lasers), np.inf)
    named = np.concatenate([lasers[first : last + 1, :2] for first, last in runs])
    return np.asarray(cKDTree(named).query(lasers[:, :2])[0])
