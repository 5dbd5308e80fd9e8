"""The legend: what the colours on the floor mean."""

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

from viser import ViserServer

from racecar.pipelines.studio.palette import Color, as_css


class Entry(NamedTuple):
    """A line of the legend."""

    words: str
    colors: Sequence[Color]
    """One, or some that go over into each other."""


class Legend:
    """At the lower left of every page, over the scale bar; messages come from above."""

    def __init__(self, server: ViserServer) -> None:
        self._html = server.gui.add_html("", order=1e9)

    def show(self, entries: Sequence[Entry]) -> None:
        """From now on."""
        rows = "".join(
            f'<div style="display:flex; align-items:center; gap:8px"><span style="width:22px; height:6px; '
            f'border-radius:3px; background:{_paint(entry.colors)}"></span>{escape(entry.words)}</div>'
            for entry in entries
        )
        self._html.content = (
            '<div data-testid="legend" style="position:fixed; left:16px; bottom:60px; z-index:5; '
            "pointer-events:none; font:13px/1.5 sans-serif; padding:6px 10px; border-radius:6px; "
            f'color:#1b1f24; background:rgba(255,255,255,0.85)">{rows}</div>'
        )


def _paint(colors: Sequence[Color]) -> str:
    names = [as_css(color) for color in colors]
    return names[0] if len(names) == 1 else f"linear-gradient(90deg, {', '.join(names)})"
