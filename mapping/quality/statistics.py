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
    agreement_of,
    pairs_of_neighbours,
    pairs_of_passes,
)
from racecar.mapping.quality.path_clearance import share_through_obstacles
from racecar.mapping.quality.step_ties import StepTies
from racecar.mapping.quality.wheel_agreement import WheelAgreement, wheel_agreement


@dataclass(frozen=True, eq=False)
class MapStatistics:
    """Figures of a whole map, and what they were taken from, place by place."""

    figures: dict[str, float]
    """By name; NaN where there was nothing to measure."""
    spread_pairs: NDArray[np.int64]
    """(Q, 2) keyframes some metres of path apart."""
    spreads: NDArray[np.float64]
    """(Q,) metres, of the second seen from the first."""
    passes: PassAgreement
    ties: StepTies
    wheels: WheelAgreement


def measure(map_: FinishedMap, config: QualityConfig) -> MapStatistics:
    """The statistics of a map of at least two keyframes."""
    session, poses, path = map_.session, map_.poses, map_.path
    edges = GraphEdges.of(session.constraints, poses)
    uncertainty = GraphUncertainty.of(edges, poses, config.max_groups)
    nodes = uncertainty.nodes
    local = _pairs_apart(path[nodes], min(config.local_distance, path[-1] / 2.0))
    spreads = uncertainty.spreads(local)
    whole = uncertainty.spreads(
        np.column_stack([np.zeros(len(nodes) - 1, dtype=np.int64), np.arange(1, len(nodes))])
    )
    passes = agreement_of(pairs_of_passes(map_, config.passes), poses, session.keyframes, config.passes)
    neighbours = agreement_of(
        pairs_of_neighbours(map_, config.passes), poses, session.keyframes, config.passes
    )
    ties = StepTies.of(edges, poses)
    wheels = wheel_agreement(session.constraints, poses, path, config.wheel_window)
    figures = {
        "path": float(path[-1]),
        "keyframes": float(len(poses)),
        "extent": float(np.hypot(*np.ptp(poses[:, :2], axis=0))),
        "spread_local": _mean(spreads),
        "spread_local_90": _quantile(spreads, 0.9),
        "spread_whole": _quantile(whole, 0.9),
        "spread_whole_mean": _mean(whole),
        "through_passes": passes.share_looked_through,
        "through_passes_90": _quantile(passes.looked_through[passes.judged > 30], 0.9),
        "through_neighbours": neighbours.share_looked_through,
        "excess_through": passes.share_looked_through - neighbours.share_looked_through,
        "pairs_of_passes": float(len(passes.pairs)),
        "walls_apart_passes": _quantile(passes.walls_apart, 0.5),
        "walls_apart_passes_mean": _mean(passes.walls_apart),
        "walls_apart_passes_90": _quantile(passes.walls_apart, 0.9),
        "walls_apart_neighbours": _quantile(neighbours.walls_apart, 0.5),
        "walls_apart_neighbours_mean": _mean(neighbours.walls_apart),
        "walls_matched_passes": float(np.mean(np.isfinite(passes.walls_apart)))
        if len(passes.pairs)
        else np.nan,
        **_residuals(edges),
        "through_obstacles": share_through_obstacles(map_.map_from_base, map_.grid),
        "wheels_metres": _quantile(wheels.metres, 0.5),
        "wheels_metres_90": _quantile(wheels.metres, 0.9),
        "wheels_metres_mean": _mean(wheels.metres),
        "wheels_radians": _quantile(wheels.radians, 0.5),
        "wheels_radians_mean": _mean(wheels.radians),
        "tie_median": _quantile(ties.by_scans, 0.5),
        "tie_90": _quantile(ties.by_scans, 0.9),
        "tie_worst": _quantile(ties.by_scans, 1.0),
        "tie_all_worst": _quantile(ties.by_all, 1.0),
        "points": float(np.mean(session.keyframes.packed().counts[session.keyframes.row_of])),
    }
    return MapStatistics(figures, nodes[local], spreads, passes, ties, wheels)


def _residuals(edges: GraphEdges) -> dict[str, float]:
    figures = {}
    for kind in ("scan_matching", "odometry", "loop_closure"):
        errors = edges.errors[edges.are(kind)]
        figures[f"residual_{kind}"] = _mean(np.hypot(errors[:, 0], errors[:, 1]))
        figures[f"residual_{kind}_radians"] = _mean(np.abs(errors[:, 2]))
        figures[f"surprise_{kind}"] = edges.surprise.get(kind, np.nan)
        figures[f"count_{kind}"] = float(len(errors))
    return figures


def _pairs_apart(path: NDArray[np.float64], distance: float) -> NDArray[np.int64]:
    """(Q, 2) indices into a path (N,) that are ``distance`` metres apart."""
    seconds = np.flatnonzero((path >= distance) & (np.arange(len(path)) > 0))
    firsts = np.maximum(np.searchsorted(path, path[seconds] - distance, side="right") - 1, 0)
    firsts = np.minimum(firsts, seconds - 1)
    return np.column_stack([firsts, seconds])


def _mean(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else float("nan")


def _quantile(values: NDArray[np.float64], share: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, share)) if len(known) else float("nan")
