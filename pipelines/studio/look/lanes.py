"""Curves over the time of a drive, one above the other: the picture behind the time bar."""

import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.runs.view.measures import Measure
from racecar.pipelines.studio.palette import CAR, LOOP, PATH, as_css

_COLORS = {"speed": PATH, "fit": CAR, "doubt": LOOP}
_BINS = 900
"""Values of a curve, of which a bar 1280 pixels wide shows each."""
_LANE = 100.0
"""Height of a lane in the units of the picture, which is stretched to the bar."""
_LEAST_TOP = {"speed": 0.5, "fit": 100.0, "doubt": 5.0}
"""The least range of a lane, so that noise does not fill it; fit always reaches from 0 to 100 %."""
_TICKS = 8
"""Labels of the time axis, at most."""


def lanes(
    measures: Sequence[Measure],
    end: float,
    spans: Sequence[tuple[float, float]],
    others: Sequence[Measure] = (),
) -> str:
    """HTML of the curves of ``measures`` until ``end`` in seconds, with doubtful ``spans`` of time as bands,
    and with those of another run as dashes."""
    height = _LANE * len(measures)
    beside = {other.name: other for other in others}
    drawn, labels = [_band(span, end, height) for span in spans], []
    for number, measure in enumerate(measures):
        top = _top([measure, *([beside[measure.name]] if measure.name in beside else [])])
        base, color = _LANE * (number + 1), as_css(_COLORS[measure.name])
        drawn.append(_curve(measure, end, top, base, f'stroke="{color}"'))
        if measure.name in beside:
            dashes = f'stroke="{color}" stroke-dasharray="2 5" stroke-width="2.5"'
            drawn.append(_curve(beside[measure.name], end, top, base, dashes))
        drawn.append(f'<line x1="0" x2="1000" y1="{base}" y2="{base}" stroke="currentColor" opacity="0.25"/>')
        labels.append(
            f'<span class="name" style="top:{100.0 * number / len(measures):.1f}%; border-color:{color}">'
            f"{escape(measure.name)} 0–{top:g} {escape(measure.unit)}</span>"
        )
    return (
        '<div class="lanes" data-testid="lanes">'
        f'<svg viewBox="0 0 1000 {height:g}" preserveAspectRatio="none">'
        f"{''.join(drawn)}</svg>{''.join(labels)}{_ticks(end)}</div>"
    )


def _curve(measure: Measure, end: float, top: float, base: float, style: str) -> str:
    seconds, values = _thinned(measure)
    x, y = 1000.0 * seconds / end, base - (_LANE - 4.0) * np.clip(values / top, 0.0, 1.0)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        '<polyline fill="none" vector-effect="non-scaling-stroke" stroke-width="1.5" '
        f'{style} points="{points}"/>'
    )


def _thinned(measure: Measure) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The worst value of each of a few hundred stretches of time, so that no spike is lost."""
    seconds, values = measure.seconds, measure.values
    if len(values) <= _BINS:
        return seconds, values
    bins = np.linspace(seconds[0], seconds[-1], _BINS, endpoint=False)
    firsts = np.unique(np.searchsorted(seconds, bins))
    worst = np.minimum if measure.is_bad_when_low else np.maximum
    return seconds[firsts], worst.reduceat(values, firsts)


def _top(measures: Sequence[Measure]) -> float:
    """The round upper end of a lane."""
    least = _LEAST_TOP[measures[0].name]
    highest = max(float(np.max(measure.values, initial=0.0)) for measure in measures)
    if highest <= least:
        return least
    power = 10.0 ** math.floor(math.log10(highest))
    return next(step * power for step in (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10) if step * power >= highest)


def _band(span: tuple[float, float], end: float, height: float) -> str:
    first, last = (1000.0 * min(max(second / end, 0.0), 1.0) for second in span)
    return (
        f'<rect x="{first:.1f}" width="{max(last - first, 2.0):.1f}" y="0" height="{height:g}" '
        f'fill="{as_css(LOOP)}" opacity="0.22"/>'
    )


def _ticks(end: float) -> str:
    step = next(
        each * 10.0**power
        for power in range(-2, 9)
        for each in (1, 2, 5)
        if end / (each * 10.0**power) <= _TICKS
    )
    return "".join(
        f'<span class="tick" style="left:{100.0 * number * step / end:.2f}%">{number * step:g} s</span>'
        for number in range(1, math.floor(end / step) + 1)
        if number * step < 0.97 * end
    )
