"""The colours of the page, on a light and on a dark background."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]

STRIP = 30
"""Pixels: height of the legend along the bottom of the page."""

PATH, LOOP, SCAN, PARTICLE, CAR, SKY, TRUTH = (
    *((0, 114, 178), (213, 94, 0), (230, 159, 0), (204, 121, 167), (0, 158, 115), (86, 180, 233)),
    (128, 128, 128),
)
"""Red, green and blue of Okabe and Ito's palette (2008), which colour-blind people can distinguish too."""


class Backdrop(NamedTuple):
    """The colours of a map."""

    free: Color
    occupied: Color
    unknown: Color


LIGHT = Backdrop((255, 255, 255), (27, 31, 36), (223, 227, 232))
"""As in map.png."""
DARK = Backdrop((44, 49, 56), (236, 240, 244), (22, 25, 29))

BY_DOUBT: tuple[Color, ...] = ((0, 158, 115), (240, 228, 66), (213, 94, 0))
"""From certain to doubtful: green, yellow and vermilion of the same palette."""
BY_TIME: tuple[Color, ...] = ((20, 85, 185), (0, 158, 200), (250, 200, 40))
"""From early to late: dark to light, so that they differ in brightness too."""


class Shades(NamedTuple):
    """Colours of individual lines, on a scale."""

    words: str
    """Text in the legend."""
    scale: tuple[Color, ...]
    """Colours at its ends and in its middle."""
    shares: NDArray[np.float64]
    """(N,) position on the scale of each line, 0 to 1."""

    @property
    def colors(self) -> NDArray[np.uint8]:
        """(N, 3) as light, not as for a screen: so a browser expects the colours of single lines."""
        places = np.linspace(0.0, 1.0, len(self.scale))
        channels = [np.interp(self.shares, places, channel) for channel in zip(*self.scale, strict=True)]
        colors = np.column_stack(channels) / 255.0
        light = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
        return np.rint(255.0 * light).astype(np.uint8)


def as_css(color: Color) -> str:
    """CSS notation of a colour."""
    return "#{:02x}{:02x}{:02x}".format(*color)
