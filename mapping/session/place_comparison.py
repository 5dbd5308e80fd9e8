"""Compare the places where a drive may lie on an earlier map: is one of them right beyond doubt?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from racecar.mapping.session.drive_placement import Placement

LEAST_METRES = 4.0
"""Metres of path times the share of it that the map explains, from which a place counts. Chosen by
judgement: a short drive of another day has 5.0. Measured: wrong places of real recordings contradict the map
by a quarter, however much they explain."""
_COMPARABLE = 0.5
"""Share of what the best place explains, from which another one is compared with it. Measured where half of
the furniture was moved: elsewhere a drive lies on the map for less than a tenth of that."""
_MARGIN = 4.0
"""Ratio of the contradictions at any other place to those at the right one, both beyond the usual. Measured
on simulated twin corridors with alike niches: at least 6 where the map shows the corridor, and up to 3 where
it shows the twin only."""
_LEAST_CONTRADICTED = (0.001, 0.1)
"""What such a ratio takes for the least: a share, plus one of the usual share. Chosen by judgement: both
vary by as much from drive to drive."""


@dataclass(frozen=True, eq=False)
class PlaceComparison:
    """Some placements of one drive."""

    found: Sequence[Placement]
    """At least one; distinct."""
    metres: float
    """Length of the drive."""
    stated: Placement | None = None
    """Where a person said that it lies, if one did: then others count only if they fit far better."""

    @cached_property
    def best(self) -> Placement:
        """The stated one, else the least contradicted of those that explain the drive."""
        return self.stated or min(self._comparable, key=lambda each: each.contradicted)

    @property
    def is_certain(self) -> bool:
        """Whether the best place is right beyond doubt."""
        return self.is_seen_enough and self.best.agrees and self.rival is None

    @property
    def is_seen_enough(self) -> bool:
        """Whether enough of the drive lies on the map at the best place."""
        return self.best.explained * self.metres >= LEAST_METRES

    @cached_property
    def rival(self) -> Placement | None:
        """The least contradicted other place that may be right, too, if any."""
        margin = _MARGIN if self.stated is None else 1.0 / _MARGIN
        others = [each for each in self._comparable if each is not self.best]
        rivals = [each for each in others if _contradicted(each) < margin * _contradicted(self.best)]
        return min(rivals, key=lambda each: each.contradicted, default=None)

    @cached_property
    def _comparable(self) -> list[Placement]:
        """Those that explain a good part of the drive."""
        possible = [each for each in self.found if each.agrees] or self.found
        most = max(each.explained for each in possible)
        return [each for each in self.found if each.explained >= _COMPARABLE * most]


def _contradicted(placement: Placement) -> float:
    """Share contradicted beyond the usual, at least what may be by chance."""
    share, of_usual = _LEAST_CONTRADICTED
    return max(placement.contradicted - placement.usual, share + of_usual * placement.usual)
