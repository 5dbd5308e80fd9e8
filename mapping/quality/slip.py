"""Expected map error if wheels are as wrong everywhere as where walls show it.

Slipping wheels bend a map where only they observe the distance travelled, and nothing there contradicts them.
But the slip of the same wheels is visible where walls constrain the scans.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, between, inverse

_LEAST = 0.005
"""Minimum share of distance by which any wheels are assumed wrong, since no less is visible: a cell of the
map over 10 m. Measured: along bare walls honest wheels with 2 % of noise leave 0.03 to 0.05 m per 10 m."""
_WINDOW = 10.0
"""Metres over which wheel errors are accumulated, since errors are expected per 10 m: what cancels within
that does not bend a map. Measured: step by step, honest wheels with 3 % of noise seem wrong by 2 to 3 %, and
4 of 10 good maps doubtful; over 10 m, none."""

_LEAST_DRIVEN = 1.0
"""Metres by wheels needed to measure a share. Chosen by judgement: a step or two at the edge of a gap, where
odometry that begins or ends late covers only a part of the distance."""


def slip_share(edges: GraphEdges, poses: Pose, are_bare: NDArray[np.bool_]) -> float:
    """Share of the wheels' distance by which a map solved to (K, 3) differs, in steps that walls constrain:
    those not ending where scans ``are_bare`` (K,). The minimum where these are few."""
    held = np.flatnonzero(_wheel_steps(edges) & ~are_bare[edges.ends[:, 1]])
    held = held[np.argsort(edges.ends[held, 1], kind="stable")]
    driven, solved = np.hypot(*edges.measured[held, :2].T), between(*poses[edges.ends[held].T])
    longer = np.clip(np.hypot(*solved[:, :2].T) - driven, -driven, driven)
    window = (np.cumsum(driven) / _WINDOW).astype(np.int64)
    missed = np.abs(np.bincount(window, longer)).sum()
    return max(float(missed / driven.sum()), _LEAST) if driven.sum() >= _LEAST_DRIVEN else _LEAST


def slip_errors(edges: GraphEdges, share: float) -> NDArray[np.float64]:
    """(C, 3) errors of constraints, relative to their second keyframes, if wheels go a share too far."""
    errors = np.zeros_like(edges.measured)
    of_wheels = _wheel_steps(edges)
    errors[of_wheels, :2] = -share * inverse(edges.measured[of_wheels])[:, :2]
    return errors


def _wheel_steps(edges: GraphEdges) -> NDArray[np.bool_]:
    """(C,) whether a constraint is a wheel step from one keyframe to the next."""
    return np.asarray(edges.are("odometry") & (edges.ends[:, 1] == edges.ends[:, 0] + 1))
