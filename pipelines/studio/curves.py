"""Curves over time in the side panel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import GuiApi, uplot

from racecar.pipelines.studio.palette import PATH, as_css

_HEIGHT = 140
"""Pixels."""
_MOST_POINTS = 1500
"""Maximum points per curve; a panel is about 300 pixels wide."""


def add_curve(gui: GuiApi, title: str, seconds: NDArray[np.float64], values: NDArray[np.float64]) -> Any:
    """Plot values (N,) over seconds (N,); assign to ``data`` to update the curve."""
    every = -(-len(seconds) // _MOST_POINTS)
    return gui.add_uplot(
        (seconds[::every], values[::every]),
        (uplot.Series(label="s"), uplot.Series(label=title, stroke=as_css(PATH), width=1)),
        title=title,
        scales={"x": uplot.Scale(time=False)},
        legend=uplot.Legend(show=False),
        height=_HEIGHT,
    )
