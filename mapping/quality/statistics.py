"""All that is measured on a finished map before it is judged."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.graph_edges import GraphEdges
from racecar.mapping.quality.graph_uncertainty import GraphUncertainty
from racecar.mapping.quality.pass_agreement import (
    PassAgreement,
    PlacePairs,
    agreement_of,
    pairs_of_neighbours,
    pairs_of_passes,
)
from racecar.mapping.quality.step_ties import StepTies
from racecar.mapping.quality.wall_directions import weakest_hold
from racecar.mapping.quality.wheel_agreement import WheelAgreement, wheel_agreement

_MOST = 0.9
"""The quantile that stands for the bad part of a map, because the mean hides a single tear."""
_FEWEST_RETURNS = 30
"""Returns of a pair of scans that must be judged, so that a share of them means something."""
_BARE = 0.03
"""Share of lines below which they hold a scan in no second direction, because so many are noise."""


@dataclass(frozen=True, eq=False)
class MapStatistics:
    """Figures of a whole map, and what they were taken from, place by place."""

    figures: dict[str, float]
    """By name; NaN where there was nothing to measure."""
    passes: PassAgreement
    places: PlacePairs
    ties: StepTies
    wheels: WheelAgreement


def measure(map_: FinishedMap, config: QualityConfig) -> MapStatistics:
    """The statistics of a map of at least two keyframes."""
    session, poses, path = map_.session, map_.poses, map_.path
    edges = GraphEdges.of(session.constraints, poses)
    store = session.keyframes
    passes = agreement_of(pairs_of_passes(map_, config.passes), poses, store, config.passes)
    places = passes.by_places(path, config.segments.length)
    neighbours = agreement_of(pairs_of_neighbours(map_, config.passes), poses, store, config.passes)
    wheels = wheel_agreement(session.constraints, poses, path, config.wheel_window)
    matches = edges.errors[edges.are("scan_matching")]
    figures = {
        "path_m": float(path[-1]),
        "spread_per_10_m": _spread(edges, poses, path, config),
        "match_residual_m": _quantile(np.hypot(matches[:, 0], matches[:, 1])),
        "looked_through_by_neighbours": _quantile(
            neighbours.looked_through[neighbours.judged > _FEWEST_RETURNS]
        ),
        "looked_through_by_passes": _quantile(
            places.looked_through[places.judged > config.segments.min_judged]
        ),
        "walls_apart_m": _quantile(passes.walls_apart[np.isfinite(passes.walls_apart)]),
        "wheels_against_map_m": float(np.mean(wheels.metres)) if len(wheels.metres) else float("nan"),
        "bare_without_wheels": _share_bare(edges, map_),
    }
    return MapStatistics(figures, passes, places, StepTies.of(edges, poses), wheels)


def _spread(
    edges: GraphEdges, poses: NDArray[np.float64], path: NDArray[np.float64], config: QualityConfig
) -> float:
    """Mean standard deviation, metres, of keyframes as seen from some distance of path before."""
    uncertainty = GraphUncertainty.of(edges, poses, config.max_groups)
    distance = min(config.local_distance, path[-1] / 2.0)
    return float(np.mean(uncertainty.spreads(_pairs_apart(path[uncertainty.nodes], distance))))


def _pairs_apart(path: NDArray[np.float64], distance: float) -> NDArray[np.int64]:
    """(Q, 2) indices into a path (N,) that are ``distance`` metres apart."""
    seconds = np.flatnonzero((path >= distance) & (np.arange(len(path)) > 0))
    firsts = np.maximum(np.searchsorted(path, path[seconds] - distance, side="right") - 1, 0)
    return np.column_stack([np.minimum(firsts, seconds - 1), seconds])


def _share_bare(edges: GraphEdges, map_: FinishedMap) -> float:
    """Share of the steps of which neither wheels nor walls tell the length."""
    has_wheels = np.zeros(len(map_.poses), dtype=np.bool_)
    has_wheels[edges.ends[edges.are("odometry"), 1]] = True
    is_bare = weakest_hold(map_.session.keyframes) < _BARE
    return float(np.mean((is_bare & ~has_wheels)[1:]))


def _quantile(values: NDArray[np.float64]) -> float:
    return float(np.quantile(values, _MOST)) if len(values) else float("nan")
