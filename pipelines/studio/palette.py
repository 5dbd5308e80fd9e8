"""The colours of the page, on a light and on a dark ground."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]

PATH, LOOP, SCAN, PARTICLE, CAR, SKY, TRUTH = (
    *((0, 114, 178), (213, 94, 0), (230, 159, 0), (204, 121, 167), (0, 158, 115), (86, 180, 233)),
    (128, 128, 128),
)
"""Red, green and blue of Okabe and Ito's palette (2008), since it is told apart by colour-blind eyes, too."""


@dataclass(frozen=True)
class Backdrop:
    """How a map is painted."""

    free: Color
    occupied: Color
    unknown: Color
    text: Color


LIGHT = Backdrop((255, 255, 255), (27, 31, 36), (223, 227, 232), (27, 31, 36))
"""As in map.png."""
DARK = Backdrop((44, 49, 56), (236, 240, 244), (22, 25, 29), (236, 240, 244))

_DOUBT_STOPS = np.array([[0, 158, 115], [240, 228, 66], [213, 94, 0]])
"""From sure to doubtful: green, yellow and vermilion of the same palette."""
_TIME_STOPS = np.array([[13, 60, 120], [0, 158, 200], [250, 200, 40]])
"""From early to late: dark to light, so that they differ without colours, too."""


def by_time(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(N, 3) colours of shares (N,) of the drive, 0 to 1."""
    return _between(_TIME_STOPS, shares)


def by_doubt(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(N, 3) colours of doubts (N,), 0 to 1."""
    return _between(_DOUBT_STOPS, shares)


def stops(scale: Callable[[NDArray[np.float64]], NDArray[np.uint8]]) -> list[Color]:
    """The colours of a scale at its ends and in its middle."""
    return [(int(r), int(g), int(b)) for r, g, b in scale(np.linspace(0.0, 1.0, 3))]


def _between(colors: NDArray[np.int64], shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    places = np.linspace(0.0, 1.0, len(colors))
    columns = [np.interp(shares, places, colors[:, channel]) for channel in range(3)]
    return np.column_stack(columns).astype(np.uint8)


def as_css(color: Color) -> str:
    """As HTML writes it."""
    return "#{:02x}{:02x}{:02x}".format(*color)
