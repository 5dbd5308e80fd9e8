"""Measure a finished map before it is judged."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.graph_motion import GraphMotion
from racecar.mapping.quality.jumps import jumps
from racecar.mapping.quality.pass_agreement import PassAgreement, PlacePairs, agreement_of, near_pairs
from racecar.mapping.quality.slip import slip_errors, slip_share
from racecar.mapping.quality.unseen_motion import unseen_motion
from racecar.sensors.matching.scan_store import ScanStore

LOCAL_DISTANCE = 10.0
"""Metres of path over which the local error is stated, by definition."""
_PLACES = 60
"""Keyframes along the path between which errors are expected. Chosen by judgement: their mean is steady."""
_MOST = 0.9
"""The quantile that represents the bad part of a map, because the mean hides a single tear."""
_BARE = 0.03
"""Share of lines below which a scan has no second direction of walls, because that much is noise."""


@dataclass(frozen=True, eq=False)
class MapStatistics:
    """Statistics of a whole map, and the local measurements behind them."""

    figures: dict[str, float]
    """By name; NaN where there was nothing to measure."""
    passes: PassAgreement
    places: PlacePairs
    stretches: NDArray[np.int64]
    """(S, 2) keyframes `LOCAL_DISTANCE` of path apart."""
    open: NDArray[np.float64]
    """(S,) uncertainty between both in metres, including wheel slip."""
    unseen_motion: NDArray[np.float64]
    """(K - 1,) metres in each step, see `unseen_motion`."""
    jumps: NDArray[np.float64]
    """(K - 1,) metres in each step, see `jumps`."""


def measure(map_: FinishedMap) -> MapStatistics:
    """Measure a map of at least two keyframes."""
    session, poses, path = map_.session, map_.poses, map_.path
    edges = GraphEdges.of(session.constraints, poses)
    near, far = near_pairs(map_)
    passes = agreement_of(far, poses, session.keyframes)
    places = passes.by_places(passes.usual(agreement_of(near, poses, session.keyframes)), path)
    are_bare = weakest_direction(session.keyframes) < _BARE
    beyond = (places.looked_through - places.usual)[places.are_seen]
    unseen, too_far = unseen_motion(map_, edges, are_bare), jumps(map_)
    stretches, any_two = _pairs(path, session.times.numbers)
    pairs, motion = np.concatenate([stretches, any_two]), GraphMotion(edges, poses)
    slip = slip_share(edges, poses, are_bare)
    spreads, shifts = motion.spreads(pairs), motion.shifts(slip_errors(edges, slip), pairs)
    matches = edges.errors[edges.are("scan_matching")]
    is_local = np.arange(len(pairs)) < len(stretches)
    figures = {
        "path_m": float(path[-1]),
        "spread_per_10_m": float(spreads[is_local].mean()),
        "spread_of_whole": float(spreads[~is_local].mean()),
        "slip_share": slip,
        "slip_per_10_m": float(shifts[is_local].mean()),
        "slip_of_whole": float(shifts[~is_local].mean()),
        "match_residual_m": float(np.hypot(*matches[:, :2].T).mean()) if len(matches) else math.nan,
        "looked_through_by_passes": float(np.quantile(beyond, _MOST)) if len(beyond) else math.nan,
        "overruled_wheels": map_.overruled_wheels,
        "unseen_way_m": float(unseen.max()),
        "jump_m": float(too_far.max()),
    }
    open_ = np.hypot(spreads[is_local], shifts[is_local])
    return MapStatistics(figures, passes, places, stretches, open_, unseen, too_far)


def _pairs(
    path: NDArray[np.float64], recordings: NDArray[np.int32]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of keyframes at a fixed distance on a path (K,) within one of the ``recordings`` (K,), and of the
    whole path: (S, 2) and (P, 2)."""
    distance = min(LOCAL_DISTANCE, path[-1] / 2.0)
    places = np.searchsorted(path, np.linspace(distance, path[-1], _PLACES)).clip(1, len(path) - 1)
    places = np.unique(places)
    before = np.searchsorted(path, path[places] - distance, side="right") - 1
    stretches = np.column_stack([np.clip(before, 0, places - 1), places])
    ends = np.unique(stretches)
    of_one = recordings[stretches[:, 0]] == recordings[stretches[:, 1]]
    stretches = stretches[of_one] if of_one.any() else stretches
    return stretches, ends[np.column_stack(np.triu_indices(len(ends), 1))]


def weakest_direction(store: ScanStore) -> NDArray[np.float64]:
    """(K,) share of a scan's lines that constrain its weakest direction: at most a half, 0 without lines.

    In a bare corridor all walls are parallel, and scan matching cannot observe the distance travelled.
    """
    packed = store.packed()
    hold = np.zeros(len(packed.counts))
    for row, normals in enumerate(packed.normals):
        x, y = normals[: packed.counts[row]].T.astype(np.float64)
        moment = np.array([[x @ x, x @ y], [x @ y, y @ y]])
        lines = moment[0, 0] + moment[1, 1]
        hold[row] = np.linalg.eigvalsh(moment)[0] / lines if lines > 0.0 else 0.0
    weakest: NDArray[np.float64] = hold[store.row_of]
    return weakest
