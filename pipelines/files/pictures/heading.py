"""What a picture says above or beside its map: of what it is, the verdict, and the facts."""

from dataclasses import dataclass
from textwrap import wrap
from typing import Any, NamedTuple

from matplotlib.figure import Figure
from matplotlib.text import Annotation

from racecar.pipelines.files.pictures.colors import QUIET_COLOR
from racecar.pipelines.files.tone import Tone

_LETTER = 0.56
"""Mean width of a letter by the size of its font, for breaking lines; that of capitals is higher. Measured on
sentences of verdicts."""
_LINE = 1.45
"""Height of a line by the size of its font."""
_TITLE_SIZE, _SIZE = 13.0, 10.0
"""Points."""
_POINTS_PER_INCH = 72.0
_PADDING = 0.1
"""Inches around a badge."""
_SEPARATOR, _UNBROKEN = "  ·  ", "\N{NO-BREAK SPACE}"


_COLORS = {Tone.GOOD: "#00704f", Tone.DOUBTFUL: "#8a5a00", Tone.BAD: "#a8321a"}
"""Dark enough for letters on white, and for white letters on them."""


class Badge(NamedTuple):
    """A verdict in a word."""

    word: str
    tone: Tone


@dataclass(frozen=True)
class Heading:
    """Title, which may be any file name; verdict; facts; and a sentence for people."""

    title: str
    badge: Badge | None = None
    facts: tuple[str, ...] = ()
    sentence: str = ""

    def height(self, width: float) -> float:
        """Inches that it takes, written over ``width`` inches."""
        return sum(line.height for line in self._lines(width))

    def draw(self, figure: Figure, left: float, top: float, width: float) -> None:
        """Write it from its upper left corner, in inches from the figure's lower left one."""
        for line in self._lines(width):
            style: dict[str, Any] = {"size": line.size, "va": "top", "transform": figure.dpi_scale_trans}
            if self.badge is not None and line.is_badge:
                _draw_badge(figure, self.badge, left, top, line.text, style)
            else:
                weight = "bold" if line.size == _TITLE_SIZE else "normal"
                figure.text(left, top, line.text, **style, color=line.color, weight=weight, parse_math=False)
            top -= line.height

    def _lines(self, width: float) -> "list[_Line]":
        lines = [_Line(text, _TITLE_SIZE) for text in _broken(self.title, width, _TITLE_SIZE)]
        facts = _SEPARATOR.join(fact.replace(" ", _UNBROKEN) for fact in self.facts)
        color = "black"
        if self.badge is not None:
            word, color = self.badge.word, _COLORS[self.badge.tone]
            does_fit = len(_broken(f"{word}  {facts}", width, _SIZE)) == 1
            beside, facts = (facts, "") if does_fit else ("", facts)
            lines.append(_Line(beside, is_badge=True))
        lines += [_Line(text, color=QUIET_COLOR) for text in _broken(facts, width, _SIZE)]
        return lines + [_Line(text, color=color) for text in _broken(self.sentence, width, _SIZE)]


class _Line(NamedTuple):
    text: str
    size: float = _SIZE
    color: str = "black"
    is_badge: bool = False

    @property
    def height(self) -> float:
        """Inches."""
        return self.size * _LINE / _POINTS_PER_INCH + (_PADDING if self.is_badge else 0.0)


def _draw_badge(figure: Figure, badge: Badge, left: float, top: float, text: str, style: Any) -> None:
    """With a text to its right."""
    box = {"boxstyle": "round,pad=0.25", "facecolor": _COLORS[badge.tone], "linewidth": 0}
    pill = figure.text(left + 0.06, top - 0.02, badge.word, **style, color="white", weight="bold", bbox=box)
    beside: dict[str, Any] = {"xycoords": pill, "xytext": (11, 0), "textcoords": "offset points"}
    figure.add_artist(Annotation(text, (1.0, 0.5), va="center", color=QUIET_COLOR, size=_SIZE, **beside))


def _broken(text: str, width: float, size: float) -> list[str]:
    printable = text.encode(errors="replace").decode()
    return wrap(printable, max(1, int(width * _POINTS_PER_INCH / (size * _LETTER))))
