"""From statistics to the error that is to be expected.

Maps go wrong in several ways, and each shows in another statistic. So the expected error is a sum: a floor,
and for each statistic a power of it. Small values add next to nothing; the one that is bad decides.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Power:
    """Metres of error that a statistic stands for: ``metres`` where it is as usual, growing with a power."""

    metres: float
    exponent: float

    def of(self, ratio: float) -> float:
        """Metres, where the statistic is ``ratio`` times what is usual."""
        return self.metres * math.pow(ratio, self.exponent)


NOTHING = Power(0.0, 1.0)
"""Of an error that a statistic says nothing about, so that it adds no metres."""


@dataclass(frozen=True)
class Term:
    """What one statistic says of the error."""

    statistic: str
    least: float
    most: float
    """Values beyond these count as these: none were seen there when the model was learned."""
    usual: float
    """The median of good maps; it stands in where there was nothing to measure."""
    local: Power
    """Of the error per 10 m."""
    whole: Power
    """Of the error of the whole map."""
    complaint: str
    """What is said of a map in which it is bad; ``{}`` is its value."""

    def ratio(self, figures: Mapping[str, float]) -> float:
        """The statistic over what is usual."""
        value = figures[self.statistic]
        value = self.usual if math.isnan(value) else value
        return min(max(value, self.least), self.most) / self.usual


@dataclass(frozen=True)
class ErrorModel:
    """The expected errors of a map."""

    local: float
    """Metres per 10 m of path that remain where all statistics are perfect."""
    whole: float
    """Metres, likewise."""
    terms: tuple[Term, ...]

    def errors(self, figures: Mapping[str, float]) -> tuple[float, float]:
        """Metres per 10 m of path, and over the whole map."""
        ratios = [(term, term.ratio(figures)) for term in self.terms]
        return (
            self.local + sum(term.local.of(ratio) for term, ratio in ratios),
            self.whole + sum(term.whole.of(ratio) for term, ratio in ratios),
        )

    def complaints(
        self, figures: Mapping[str, float], share: float, without: Collection[str] = ()
    ) -> list[str]:
        """What makes up at least a ``share`` of one of the expected errors, the weightiest first; ``without``
        the statistics of which more is said elsewhere."""
        local, whole = self.errors(figures)
        parts = []
        for term in self.terms:
            if term.statistic in without:
                continue
            ratio = term.ratio(figures)
            parts.append((max(term.local.of(ratio) / local, term.whole.of(ratio) / whole), term))
        weighty = sorted((part for part in parts if part[0] >= share), key=lambda part: -part[0])
        return [term.complaint.format(figures[term.statistic]) for _, term in weighty]
