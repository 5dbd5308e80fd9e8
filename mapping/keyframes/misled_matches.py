"""Where scan matches are misled, as by ground that comes into view on a slope and moves along.

Wheels and scans contradict each other where either errs. Where wheels slip, the scans fit each other as well
as anywhere else; where scans are misled, they fit worse. So a contradiction is blamed on the scans as far as
contradictions are more frequent where scans fit that badly than where they fit well.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.config import ConstraintConfig, MisledConfig
from racecar.mapping.keyframes.constraints import match_pairs
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.odometry.calibration import SIGMA_PER_MEDIAN
from racecar.maps.geometry.se2 import Pose, between


def misled_steps(
    by_wheels: list[Constraint],
    poses: Pose,
    store: ScanStore,
    constraints: ConstraintConfig,
    config: MisledConfig,
) -> NDArray[np.bool_]:
    """(K - 1,) the steps between keyframes at (K, 3) in which scan matching is misled, by what the wheels
    measured of some of them."""
    steps = np.full((max(len(poses) - 1, 0), 3), np.nan)
    for constraint in by_wheels:
        steps[constraint.from_keyframe] = constraint.from_pose_to_pose
    off, residuals = np.full_like(steps, np.nan), np.full(len(steps), np.nan)
    both = np.flatnonzero(store.is_kept[:-1] & store.is_kept[1:] & ~np.isnan(steps[:, 0]))
    if len(both) < config.min_steps:
        return np.zeros(len(steps), dtype=np.bool_)
    matches, good = match_pairs(np.column_stack([both, both + 1]), poses, store, constraints)
    off[both[good]] = between(matches.poses[good], steps[both[good]])
    residuals[both[good]] = matches.residual[good]
    turns = np.zeros(len(steps))
    turns[both[good]] = np.abs(matches.poses[good, 2])
    return are_misled(off, turns, residuals, config)


def are_misled(
    off: Pose, turns: NDArray[np.float64], residuals: NDArray[np.float64], config: MisledConfig
) -> NDArray[np.bool_]:
    """(S,) of steps in which the wheels were ``off`` (S, 3) from the match, and which ended with
    ``residuals`` (S,), metres; NaN where nothing matched. ``turns`` (S,) are those of the matches, radians.

    Scans fit worse in turns, where some wheels err most, so that steps are compared with others that turn
    as much.
    """
    is_known = ~np.isnan(residuals)
    misled = np.zeros(len(residuals), dtype=np.bool_)
    if np.count_nonzero(is_known) < config.min_steps:
        return misled
    are_contradicted = is_known & (_contradicted(off[:, 0], config) | _contradicted(off[:, 2], config))
    fit = np.full_like(residuals, np.nan)
    fit[is_known] = np.nanmedian(_about(residuals, config.window)[is_known], axis=1)
    usual_fit = float(np.median(fit[is_known]))
    turned = np.nansum(_about(turns, config.window), axis=1)
    fit_well = is_known & (fit <= usual_fit)
    edges = np.quantile(fit[is_known], np.linspace(0.0, 1.0, config.classes + 1)[1:-1])
    of_class = np.searchsorted(edges, fit)
    for k in range(config.classes):
        members = is_known & (of_class == k) & (fit > config.bad_fit * usual_fit)
        if not members.any():
            continue
        comparable = fit_well & (turned >= np.median(turned[members]))
        usual_rate = _share(are_contradicted[comparable]) if comparable.any() else 1.0
        if _share(are_contradicted[members]) > max(config.min_rate, config.times_usual * usual_rate):
            misled |= members & are_contradicted
    return misled


def _share(are: NDArray[np.bool_]) -> float:
    return float(np.mean(are))


def _contradicted(off: NDArray[np.float64], config: MisledConfig) -> NDArray[np.bool_]:
    """(S,) whether matches and wheels drift apart about each step by more than single steps (S,) explain."""
    sigma = max(SIGMA_PER_MEDIAN * float(np.nanmedian(np.abs(off))), config.least_sigma)
    drift = np.nansum(_about(off, config.window), axis=1)
    return np.asarray(np.abs(drift) > config.most_sigmas * sigma * np.sqrt(config.window))


def _about(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """(S, window) the values (S,) about each."""
    padded = np.pad(values, (window // 2, window - 1 - window // 2), constant_values=np.nan)
    return sliding_window_view(padded, window)
