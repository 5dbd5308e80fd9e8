"""The scale bar of a page."""

import math

from viser import CameraHandle, ClientHandle

from racecar.pipelines.studio.palette import STRIP

_SHARE = 0.25
"""Maximum length as a share of the map's height: it is as high as the page at most, but not as wide."""


class ScaleBar:
    """A bar of a round length at the lower left, to the scale of the page's map."""

    def __init__(self, client: ClientHandle) -> None:
        self._html = client.gui.add_html("")
        self._shown: tuple[float, int] | None = None

    def fit(self, camera: CameraHandle) -> None:
        """Adapt to the zoom."""
        metres = 2.0 * float(camera.position[2]) * math.tan(camera.fov / 2.0)
        length = round_length(_SHARE * metres)
        shown = length, round(camera.image_height * length / metres)
        if shown != self._shown:
            self._shown = shown
            self._html.content = _bar(*shown)


def round_length(most: float) -> float:
    """The longest of 1, 2, 5, 10, … that is not longer than ``most``."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1, 2, 5) if step * power <= most)


def _bar(length: float, pixels: int) -> str:
    return (
        '<div class="racecar" data-testid="scale" style="left:16px; pointer-events:none; text-align:center; '
        f'bottom:calc({STRIP + 12}px + var(--bar, 0px)); padding:3px 6px; border-radius:4px">'
        f'{length:g} m<div style="width:{pixels}px; height:5px; background:currentColor"></div></div>'
    )
