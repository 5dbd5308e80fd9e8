"""All that is measured on a finished map before it is judged."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.closed_steps import closed_steps
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.graph_uncertainty import GraphUncertainty
from racecar.mapping.quality.jumps import jumps
from racecar.mapping.quality.pass_agreement import PassAgreement, PlacePairs, agreement_of, near_pairs
from racecar.mapping.quality.slip import pull_of_slip, slip_share
from racecar.mapping.quality.step_ties import StepTies
from racecar.mapping.quality.unseen_stands import unseen_stands
from racecar.mapping.quality.wall_directions import weakest_hold
from racecar.mapping.quality.wheel_agreement import WheelAgreement, wheel_agreement

LOCAL_DISTANCE = 10.0
"""Metres of path over which the local error is stated, by definition."""
_PLACES = 60
"""Keyframes, evenly over the path, of which the spread is computed; by judgement, its mean is steady."""
_MOST = 0.9
"""The quantile that stands for the bad part of a map, because the mean hides a single tear."""
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
    unseen_stands: NDArray[np.float64]
    """(K - 1,) metres in each step, see `unseen_stands`."""
    jumps: NDArray[np.float64]
    """(K - 1,) metres in each step, see `jumps`."""


def measure(map_: FinishedMap) -> MapStatistics:
    """The statistics of a map of at least two keyframes."""
    session, poses, path = map_.session, map_.poses, map_.path
    edges = GraphEdges.of(session.constraints, poses)
    store = session.keyframes
    near, far = near_pairs(map_)
    neighbours, passes = agreement_of(near, poses, store), agreement_of(far, poses, store)
    places = passes.by_places(passes.usual(neighbours), path)
    matches = edges.errors[edges.are("scan_matching")]
    wheels = wheel_agreement(session.constraints, poses, path)
    has_wheels = np.zeros(len(poses), dtype=np.bool_)
    has_wheels[edges.ends[edges.are("odometry"), 1]] = True
    are_bare = weakest_hold(store) < _BARE
    are_closed = closed_steps(edges, are_bare)
    stands = unseen_stands(map_, has_wheels, are_bare, are_closed)
    beyond = jumps(map_)
    uncertainty, (pairs, are_near) = GraphUncertainty(edges, poses), _pairs(path)
    slip = slip_share(edges, poses, are_bare)
    spreads, shifts = uncertainty.spreads(pairs), uncertainty.shifts(pull_of_slip(edges, poses, slip), pairs)
    figures = {
        "path_m": float(path[-1]),
        "spread_per_10_m": _mean(spreads[are_near]),
        "spread_of_whole": _mean(spreads[~are_near]),
        "slip_share": slip,
        "slip_per_10_m": _mean(shifts[are_near]),
        "slip_of_whole": _mean(shifts[~are_near]),
        "match_residual_m": _mean(np.hypot(matches[:, 0], matches[:, 1])),
        "looked_through_by_neighbours": neighbours.share,
        "looked_through_by_passes": _quantile((places.looked_through - places.usual)[places.are_seen]),
        "wheels_against_map_m": _mean(wheels.metres),
        "bare_without_wheels": _share_bare(has_wheels, are_bare, map_),
        "overruled_wheels": map_.overruled_wheels,
        "denied_by_map_m": wheels.unsettled(are_closed),
        "unseen_way_m": float(stands.max()),
        "jump_m": float(beyond.max()),
    }
    return MapStatistics(figures, passes, places, StepTies.of(edges, poses), wheels, stands, beyond)


def _pairs(path: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(P, 2) keyframes some distance of path apart, which are near (P,), and any two of the whole path."""
    distance = min(LOCAL_DISTANCE, path[-1] / 2.0)
    places = np.searchsorted(path, np.linspace(distance, path[-1], _PLACES)).clip(1, len(path) - 1)
    places = np.unique(places)
    before = np.searchsorted(path, path[places] - distance, side="right") - 1
    local = np.column_stack([np.clip(before, 0, places - 1), places])
    whole = places[np.column_stack(np.triu_indices(len(places), 1))] if len(places) > 1 else local
    return np.concatenate([local, whole]), np.repeat([True, False], [len(local), len(whole)])


def _share_bare(has_wheels: NDArray[np.bool_], are_bare: NDArray[np.bool_], map_: FinishedMap) -> float:
    """Share of the steps of which neither wheels nor walls tell the length; of the time, if that is more,
    where wheels were left out for a while, since a car that is carried unseen makes few steps."""
    without = ~has_wheels[1:]
    seconds = np.nan_to_num(np.diff(map_.seconds)) if has_wheels.any() else np.zeros(len(without))
    untold = seconds[(are_bare[1:] | are_bare[:-1]) & without]
    return max(float(np.mean(are_bare[1:] & without)), float(untold.sum() / max(seconds.sum(), 1e-9)))


def _mean(values: NDArray[np.float64]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _quantile(values: NDArray[np.float64]) -> float:
    return float(np.quantile(values, _MOST)) if len(values) else float("nan")
