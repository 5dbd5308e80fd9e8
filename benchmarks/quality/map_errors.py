"""How far a map is off, as the verdict states it: between places near each other, and as a whole."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.harness.table import Column
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.runs.evaluation.relations import missed_relations
from racecar.pipelines.simulation.path_smoothing import lengths_along

_PLACES = 80
"""Along the path, of which all pairs make up the error of the whole: some thousand, of which a mean is
exact enough."""
_REACH = 4.0
"""Metres within which two passes see the same, as where the verdict compares them."""
_MOST_PAIRS = 20_000
"""Pairs of passes that are compared at most, evenly, so that a long drive takes no longer."""
_LEAST_STEP, _LARGEST_STEP = 0.001, 0.5
"""Metres of path that a keyframe stands for at least and at most, so that neither one who stands and turns
nor a gap decides alone."""


@dataclass(frozen=True)
class MapErrors:
    """Of K keyframes."""

    path_m: Annotated[float, Column("path (m)", ".0f")]
    """True length."""
    local_m: Annotated[float, Column("m per 10 m", ".2f")]
    """Mean error of a keyframe's place seen from the keyframe some metres of path before, or seen from those
    near it of other passes, whichever is worse; metres."""
    whole_m: Annotated[float, Column("of all (m)", ".2f")]
    """Mean error of a keyframe's place seen from any other, metres."""
    worst_m: float
    """The largest error over these metres of path."""
    worst: tuple[int, int]
    """From which keyframe to which."""


def map_errors(found: Pose, true: Pose, distance: float) -> MapErrors:
    """Of keyframes (K, 3), K at least 2, against the true ones (K, 3); ``distance`` metres of path apart for
    the local error, or half the path where that is shorter."""
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
    """Mean error of a keyframe's place seen from one near it, over ``distance`` metres of path later; 0 where
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
    """(R,) metres between where a keyframe was seen from another one and where it is in the map."""
    off = missed_relations(found, true, first, second)
    return np.hypot(off[:, 0], off[:, 1])
