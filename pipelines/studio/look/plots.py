"""How sure the pose was, over the drive."""

import numpy as np
from viser import uplot

from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import PATH, as_css
from racecar.pipelines.view.scene import Scene

_MOST_POINTS = 1500
"""Of a curve: a panel is some 300 pixels wide."""
_HEIGHT = 150
"""Pixels."""


def add_plots(page: Page, scene: Scene) -> None:
    """The standard deviations of place and heading, where the run has them."""
    if not np.any(scene.covariances):
        return
    every = -(-len(scene.trajectory) // _MOST_POINTS)
    seconds = (scene.trajectory.stamps[::every] - scene.trajectory.stamps[0]) * 1e-9
    deviations = scene.deviations[::every]
    with page.folder("Standard deviation", is_open=False):
        for words, values in (
            ("place (cm)", 100.0 * deviations[:, 0]),
            ("heading (°)", np.degrees(deviations[:, 1])),
        ):
            page.gui.add_uplot(
                (seconds, values),
                (uplot.Series(label="s"), uplot.Series(label=words, stroke=as_css(PATH), width=1)),
                title=words,
                scales={"x": uplot.Scale(time=False)},
                legend=uplot.Legend(show=False),
                height=_HEIGHT,
            )
