"""The scale bar of a page."""

import math

from viser import CameraHandle, ClientHandle

_SHARE = 0.25
"""Maximum length as a share of the page's height: the map is as high as the page, but not as wide."""


class ScaleBar:
    """A bar of a round length at the lower left, to the scale of the page's map."""

    def __init__(self, client: ClientHandle) -> None:
        self._html = client.gui.add_html("")
        self._shown: tuple[float, float] | None = None

    def fit(self, camera: CameraHandle) -> None:
        """Adapt to the zoom."""
        metres = 2.0 * float(camera.position[2]) * math.tan(camera.fov / 2.0)
        length = round_length(_SHARE * metres)
        shown = length, round(100.0 * length / metres, 2)
        if shown != self._shown:
            self._shown = shown
            self._html.content = _bar(*shown)


def round_length(most: float) -> float:
    """The longest of 1, 2, 5, 10, … that is not longer than ``most``."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1, 2, 5) if step * power <= most)


def _bar(length: float, percent: float) -> str:
    return (
        '<div data-testid="scale" style="position:fixed; left:16px; bottom:16px; z-index:5; '
        "pointer-events:none; font:13px sans-serif; text-align:center; padding:3px 6px; "
        'border-radius:4px; color:#1b1f24; background:rgba(255,255,255,0.8)">'
        f'{length:g} m<div style="width:{percent}vh; height:5px; background:#1b1f24"></div></div>'
    )
