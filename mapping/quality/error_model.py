"""From statistics to the error that is to be expected: a linear model of logarithms.

The logarithm of the error is a sum over statistics; each counts by the logarithm of how far it is from what
is usual on good maps, within the range in which it was learned.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Term:
    """What one statistic says of the error."""

    statistic: str
    least: float
    most: float
    """Values beyond these count as these."""
    usual: float
    """Stands in where there was nothing to measure."""
    local: float
    """Exponent: the error per 10 m grows with this power of the statistic."""
    whole: float
    """The same of the error of the whole map."""
    complaint: str
    """What is said of a map in which it is far from usual; ``{}`` is its value."""

    def log_ratio(self, figures: Mapping[str, float]) -> float:
        """Logarithm of the statistic over what is usual."""
        value = figures.get(self.statistic, math.nan)
        value = self.usual if math.isnan(value) else value
        return math.log(min(max(value, self.least), self.most) / self.usual)


@dataclass(frozen=True)
class ErrorModel:
    """The expected errors of a map all of whose statistics are as usual, and what changes them."""

    local: float
    """Metres per 10 m of path."""
    whole: float
    """Metres."""
    terms: tuple[Term, ...]

    def errors(self, figures: Mapping[str, float]) -> tuple[float, float]:
        """Metres per 10 m of path, and over the whole map."""
        ratios = [term.log_ratio(figures) for term in self.terms]
        local = sum(term.local * ratio for term, ratio in zip(self.terms, ratios, strict=True))
        whole = sum(term.whole * ratio for term, ratio in zip(self.terms, ratios, strict=True))
        return self.local * math.exp(local), self.whole * math.exp(whole)

    def complaints(self, figures: Mapping[str, float], least: float) -> list[str]:
        """What raises the expected error per 10 m by a factor of ``least`` or more, the weightiest first."""
        raised = [(term.local * term.log_ratio(figures), term) for term in self.terms]
        raised = sorted((r for r in raised if r[0] >= math.log(least)), key=lambda r: -r[0])
        return [term.complaint.format(figures.get(term.statistic, math.nan)) for _, term in raised]
