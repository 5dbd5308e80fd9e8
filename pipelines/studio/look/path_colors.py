"""How the path of a run is coloured."""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.runs.view.scene import Scene
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.palette import PATH, Color, by_doubt, by_time, stops

_DOUBTFUL_DEVIATION = 0.3
"""Metres of standard deviation of the place that are painted as most doubtful: about the car's width."""


class PathColoring(str, Enum):
    """What the path's colour says."""

    PLAIN = "one colour"
    TIME = "time"
    DOUBT = "doubt"


def path_colors(scene: Scene, coloring: PathColoring) -> Color | NDArray[np.uint8]:
    """One colour, or one (S, 3) for each pose of the trajectory."""
    if coloring == PathColoring.PLAIN:
        return PATH
    if coloring == PathColoring.TIME:
        return by_time(np.linspace(0.0, 1.0, len(scene.trajectory)))
    return by_doubt(_doubts(scene))


def path_entry(coloring: PathColoring) -> Entry:
    """Its line of the legend."""
    if coloring == PathColoring.PLAIN:
        return Entry("path", [PATH])
    paint = by_time if coloring == PathColoring.TIME else by_doubt
    words = "path, early to late" if coloring == PathColoring.TIME else "path, sure to doubtful"
    return Entry(words, stops(paint))


def _doubts(scene: Scene) -> NDArray[np.float64]:
    """(S,) 0 to 1: how wide the estimate was, and 1 in the stretches that the verdict names."""
    doubts = np.zeros(len(scene.trajectory))
    if np.any(scene.covariances):
        doubts = np.minimum(scene.deviations[:, 0] / _DOUBTFUL_DEVIATION, 1.0)
    seconds = (scene.trajectory.stamps - scene.trajectory.stamps[0]) * 1e-9
    for doubt in scene.doubts:
        if doubt.seconds is not None:
            doubts[(seconds >= doubt.seconds[0]) & (seconds <= doubt.seconds[1])] = 1.0
    return doubts
