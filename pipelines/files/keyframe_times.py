"""When keyframes were taken: a session does not say, the trajectory of its latest drive does."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.maps.trajectory import Trajectory

SAME_PLACE = 1e-6
"""Metres, since the trajectory's file holds a nanometre."""


def scans_of_keyframes(
    places: NDArray[np.float64], trajectory: Trajectory
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(K,) the scan of a trajectory that has the place (K, 2) of each keyframe, and (K,) whether one has:
    none that of a keyframe of earlier drives."""
    found = cKDTree(trajectory.map_from_base[:, :2]).query(places)
    return np.asarray(found[1], dtype=np.int64), np.asarray(found[0]) < SAME_PLACE


def seconds_of_keyframes(places: NDArray[np.float64], trajectory: Trajectory) -> NDArray[np.float64]:
    """(K,) of each keyframe since the trajectory began; NaN of those of earlier drives."""
    scans, are_known = scans_of_keyframes(places, trajectory)
    seconds = (trajectory.stamps[scans] - trajectory.stamps[0]) * 1e-9
    return np.where(are_known, seconds, np.nan)
