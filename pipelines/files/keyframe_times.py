"""Times of keyframes, taken from the trajectory of the latest drive, since a session does not store them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.maps.trajectory import Trajectory

SAME_PLACE = 1e-6
"""Metres; the trajectory's file resolves a nanometre."""


def scans_of_keyframes(
    places: NDArray[np.float64], trajectory: Trajectory
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(K,) the scan of the trajectory at the place (K, 2) of each keyframe, and (K,) whether there is one;
    keyframes of earlier drives have none."""
    found = cKDTree(trajectory.map_from_base[:, :2]).query(places)
    return np.asarray(found[1], dtype=np.int64), np.asarray(found[0]) < SAME_PLACE


def seconds_of_keyframes(places: NDArray[np.float64], trajectory: Trajectory) -> NDArray[np.float64]:
    """(K,) seconds of each keyframe since the start of the trajectory; NaN for earlier drives."""
    scans, are_known = scans_of_keyframes(places, trajectory)
    seconds = (trajectory.stamps[scans] - trajectory.stamps[0]) * 1e-9
    return np.where(are_known, seconds, np.nan)
