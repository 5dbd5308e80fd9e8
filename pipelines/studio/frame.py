"""What surrounds the map on the page: a strip along the bottom with the legend, the headline, the colours.

All of it is HTML of the side panel, which style sheets move to its place; so it is the same on every page.
"""

from collections.abc import Sequence
from html import escape

from viser import GuiApi

from racecar.pipelines.files.tone import Tone
from racecar.pipelines.runs.view.headline import Headline
from racecar.pipelines.studio.layers import Entry
from racecar.pipelines.studio.palette import BY_DOUBT, DARK, LIGHT, SCAN, STRIP, TRUTH, Color, as_css

_STYLE = f"""<style>
#root {{ height: calc(100% - {STRIP}px - var(--bar, 0px)) !important; }}
[data-mantine-color-scheme] {{ --mantine-color-dimmed: var(--mantine-color-text) !important; }}
canvas[data-engine] {{ background: {as_css(LIGHT.unknown)}; }}
[data-mantine-color-scheme=dark] canvas[data-engine] {{ background: {as_css(DARK.unknown)}; }}
.racecar {{ position: fixed; z-index: 5; font: 14px/1.5 sans-serif; color: var(--mantine-color-text);
  background: var(--mantine-color-body); }}
.racecar.legend {{ left: 0; right: 0; bottom: 0; height: {STRIP}px; display: flex; align-items: center;
  gap: 18px; padding: 0 16px; box-sizing: border-box; overflow: hidden; white-space: nowrap;
  border-top: 1px solid var(--mantine-color-default-border); }}
.racecar.legend div {{ display: flex; align-items: center; gap: 7px; }}
.racecar.legend i {{ width: 24px; height: 7px; border-radius: 4px; }}
.racecar.headline {{ left: 16px; top: 14px; max-width: min(48vw, 640px); border-radius: 8px;
  box-shadow: 0 1px 6px rgba(0, 0, 0, 0.3); border-left: 10px solid; }}
.racecar.headline summary, .racecar.headline b {{ font: bold 22px/1.3 sans-serif; padding: 6px 14px 3px;
  display: block; }}
.racecar.headline summary {{ cursor: pointer; }}
.racecar.headline summary::after {{ content: " ▾"; font-size: 15px; }}
.racecar.headline ul {{ margin: 0; padding: 0 14px 9px 32px; max-height: 40vh; overflow: auto; }}
.racecar.headline p {{ margin: 0; padding: 0 14px 8px; }}
.mantine-Notifications-root {{ top: 96px !important; }}
.mantine-Notification-root {{ pointer-events: none !important; }}
.mantine-Notification-closeButton {{ pointer-events: all; }}
</style>"""


_COLORS = {Tone.GOOD: BY_DOUBT[0], Tone.DOUBTFUL: SCAN, Tone.BAD: BY_DOUBT[2], Tone.NEUTRAL: TRUTH}


class Frame:
    """The legend and the headline of the current screen."""

    def __init__(self, gui: GuiApi) -> None:
        gui.add_html(_STYLE, order=1e9)
        self._legend = gui.add_html(_legend([]), order=1e9)
        self._headline = gui.add_html("", order=1e9)

    def begin_anew(self) -> None:
        """Take away the headline."""
        self._headline.content = ""

    def show_legend(self, entries: Sequence[Entry]) -> None:
        """Show what colours mean; entries without words are omitted."""
        content = _legend(entries)
        if self._legend.content != content:
            self._legend.content = content

    def head(self, headline: Headline) -> None:
        """Show a headline over the map."""
        content = _headline(headline)
        if self._headline.content != content:
            self._headline.content = content


def _legend(entries: Sequence[Entry]) -> str:
    rows = "".join(
        f'<div><i style="background:{_background(entry.colors)}"></i>{escape(entry.words)}</div>'
        for entry in entries
        if entry.words
    )
    return f'<div class="racecar legend" data-testid="legend">{rows}</div>'


def _headline(headline: Headline) -> str:
    words, inner = escape(headline.words), f"<b>{escape(headline.words)}</b>"
    if headline.reasons:
        listed = "".join(f"<li>{escape(reason)}</li>" for reason in headline.reasons)
        inner = f"<details><summary>{words}</summary><ul>{listed}</ul></details>"
    below = f"<p>{escape(headline.below)}</p>" if headline.below else ""
    return (
        '<div class="racecar headline" data-testid="headline" '
        f'style="border-color:{as_css(_COLORS[headline.tone])}">{inner}{below}</div>'
    )


def _background(colors: tuple[Color, ...]) -> str:
    names = [as_css(color) for color in colors]
    return names[0] if len(names) == 1 else f"linear-gradient(90deg, {', '.join(names)})"
