"""How far the map would be off were wheels wrong everywhere by what they are wrong by where walls hold.

Wheels that slip bend a map where nothing but they say how far the car came, and nothing there contradicts
them. But the same wheels are seen to slip where walls hold the scans.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, between, inverse

_LEAST = 0.005
"""Share of the way that any wheels are taken to be wrong by, since no less shows: a cell of the map over
10 m. Measured: along bare walls honest wheels with 2 % of noise leave 0.03 to 0.05 m per 10 m."""
_WINDOW = 10.0
"""Metres over which what wheels are wrong by adds up, since errors are expected per 10 m: what comes and
goes within that does not bend a map. Measured: step by step, honest wheels with 3 % of noise seem wrong by 2
to 3 %, and 4 of 10 good maps doubtful; over 10 m, none."""

_LEAST_WAY = 1.0
"""Metres by wheels below which they show no share of their own; by judgement: a step or two at the edge of a
gap, where odometry that begins or ends late tells a part of the way."""


def slip_share(edges: GraphEdges, poses: Pose, are_bare: NDArray[np.bool_]) -> float:
    """Share of the way by wheels by which a map solved to (K, 3) has it longer or shorter, where walls hold
    its steps: their ends are not among those that ``are_bare`` (K,). The least one where these are few."""
    held = np.flatnonzero(_wheel_steps(edges) & ~are_bare[edges.ends[:, 1]])
    held = held[np.argsort(edges.ends[held, 1], kind="stable")]
    ways, solved = np.hypot(*edges.measured[held, :2].T), between(*poses[edges.ends[held].T])
    longer = np.clip(np.hypot(*solved[:, :2].T) - ways, -ways, ways)
    window = (np.cumsum(ways) / _WINDOW).astype(np.int64)
    missed = np.abs(np.bincount(window, longer)).sum()
    return max(float(missed / ways.sum()), _LEAST) if ways.sum() >= _LEAST_WAY else _LEAST


def slip_errors(edges: GraphEdges, share: float) -> NDArray[np.float64]:
    """(C, 3) by which constraints err, seen from their second keyframes, where wheels go a share too far."""
    errors = np.zeros_like(edges.measured)
    of_wheels = _wheel_steps(edges)
    errors[of_wheels, :2] = -share * inverse(edges.measured[of_wheels])[:, :2]
    return errors


def _wheel_steps(edges: GraphEdges) -> NDArray[np.bool_]:
    """(C,) which constraints are by wheels, from one keyframe to the next."""
    return np.asarray(edges.are("odometry") & (edges.ends[:, 1] == edges.ends[:, 0] + 1))
