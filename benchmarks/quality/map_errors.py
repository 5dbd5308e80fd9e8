"""The error of a map as the verdict states it: between nearby places, and over the whole map."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.harness.table import Column
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.runs.evaluation.relations import missed_relations

_PLACES = 80
"""Number of places along the path whose pairs give the error of the whole map: a few thousand pairs, enough
for an accurate mean."""
_REACH = 4.0
"""Metres within which two passes see the same; the same as for the verdict."""
_MOST_PAIRS = 20_000
"""Maximum number of pairs of passes compared, evenly spaced, so that a long drive takes no longer."""
_LEAST_STEP, _LARGEST_STEP = 0.001, 0.5
"""Bounds on the metres of path that a keyframe represents, so that neither turning on the spot nor a gap
dominates."""


@dataclass(frozen=True)
class MapErrors:
    """Errors of K keyframes."""

    path_m: Annotated[float, Column("path (m)", ".0f")]
    """True length in metres."""
    local_m: Annotated[float, Column("m per 10 m", ".2f")]
    """Mean position error of a keyframe relative to the keyframe some metres of path before it, or to nearby
    keyframes of other passes, whichever is worse; metres."""
    whole_m: Annotated[float, Column("of all (m)", ".2f")]
    """Mean position error of a keyframe relative to any other, metres."""
    worst_m: float
    """Largest error over this length of path, metres."""
    worst: tuple[int, int]
    """The pair of keyframes with that error."""


def map_errors(found: Pose, true: Pose, distance: float) -> MapErrors:
    """Errors of keyframes (K, 3), K at least 2, against the true ones (K, 3). The local error is over
    ``distance`` metres of path, or half of the path if that is shorter."""
    along = lengths_along(true[:, :2])
    reach = min(distance, float(along[-1]) / 2.0)
    second = np.flatnonzero((along >= reach) & (np.arange(len(along)) > 0))
    first = np.maximum(np.searchsorted(along, along[second] - reach, side="right") - 1, 0)
    first = np.minimum(first, second - 1)
    errors = _missed(found, true, first, second)
    stands_for = np.clip(np.gradient(along)[second], _LEAST_STEP, _LARGEST_STEP)
    worst = int(np.argmax(errors))
    places = np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], _PLACES)).clip(0, len(along) - 1))
    pairs = np.array(np.triu_indices(len(places), 1))
    overall = _missed(found, true, *places[pairs]) if len(places) > 1 else errors
    return MapErrors(
        path_m=float(along[-1]),
        local_m=max(float(np.average(errors, weights=stands_for)), _between_passes(found, true, distance)),
        whole_m=float(np.mean(overall)),
        worst_m=float(errors[worst]),
        worst=(int(first[worst]), int(second[worst])),
    )


def _between_passes(found: Pose, true: Pose, distance: float) -> float:
    """Mean position error of a keyframe relative to one near it, over ``distance`` metres of path later; 0 if
    no place is passed twice."""
    along = lengths_along(true[:, :2])
    pairs = np.sort(cKDTree(true[:, :2]).query_pairs(_REACH, output_type="ndarray"), axis=1)
    pairs = pairs[along[pairs[:, 1]] - along[pairs[:, 0]] > distance]
    if len(pairs) == 0:
        return 0.0
    chosen = pairs[np.linspace(0, len(pairs) - 1, min(len(pairs), _MOST_PAIRS)).astype(np.int64)]
    return float(np.mean(_missed(found, true, *chosen.T)))


def _missed(
    found: Pose, true: Pose, first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(R,) metres of error in the position of keyframes ``second`` relative to keyframes ``first``."""
    off = missed_relations(found, true, first, second)
    return np.hypot(off[:, 0], off[:, 1])
