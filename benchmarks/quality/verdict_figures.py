"""Counts how often verdicts were right."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from benchmarks.harness.table import Column
from benchmarks.quality.map_errors import MapErrors
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.map_quality import Verdict

TRUE_KINDS = ("good", "between", "wrong")
NEAR = 10.0
"""Metres between a reported place and the worst error within which that error counts as found. Chosen by
judgement: it is in view."""
_WRONG_FACTOR = 3.0
"""Ratio of a map's error to that of a good one above which it is clearly wrong: three times, by definition of
the figures."""
_LOCAL, _WHOLE = (0.03, 1.0), (0.1, 5.0)
"""Metres at which expected and true errors are clipped. References err by as much as the lower bounds. A map
with an error at the upper bounds, ten times that of a good one, is useless anyway."""


@dataclass(frozen=True)
class JudgedMap:
    """A map, its errors and the verdict on it."""

    kind: Annotated[str, Column("is")]
    """The true kind of the map, one of `TRUE_KINDS`."""
    verdict: Annotated[str, Column("called")]
    errors: MapErrors
    expected_local_m: Annotated[float, Column("expected (m per 10 m)", ".2f")]
    expected_whole_m: Annotated[float, Column("expected of all (m)", ".2f")]
    place_off_m: float | None
    """From the worst error to the nearest reported segment; None without one."""
    near_share: float
    """Share of all keyframes within `NEAR` of a reported segment."""
    judging_seconds: float
    statistics: dict[str, float]


@dataclass(frozen=True)
class VerdictShare:
    """A share, NaN if there is nothing to count."""

    measured: Annotated[float, Column("measured", ".1%")]
    by_chance: Annotated[float | None, Column("by chance", ".1%")] = None
    """For expected errors: the best share for one error expected of all maps. For places: the share of
    keyframes near a reported one."""


def kind_of(errors: MapErrors, config: QualityConfig) -> str:
    """The true kind of a map."""
    excess = max(errors.local_m / config.good_local, errors.whole_m / config.good_whole)
    return TRUE_KINDS[int(excess > 1.0) + int(excess > _WRONG_FACTOR)]


def verdict_counts(maps: Sequence[JudgedMap]) -> dict[str, dict[str, int]]:
    """Number of maps of each kind, by verdict."""
    counts = {kind: {verdict.value: 0 for verdict in Verdict} for kind in TRUE_KINDS}
    for judged in maps:
        counts[judged.kind][judged.verdict] += 1
    return counts


def verdict_shares(maps: Sequence[JudgedMap]) -> dict[str, VerdictShare]:
    """The accuracy of the verdicts on maps, at least one."""
    wrong = [judged for judged in maps if judged.kind == "wrong"]
    return {
        "wrong maps called good": VerdictShare(_share([each.verdict == "good" for each in wrong])),
        "good maps called wrong": VerdictShare(
            _share([each.verdict == "wrong" for each in maps if each.kind == "good"])
        ),
        "maps called doubtful": VerdictShare(_share([each.verdict == "doubtful" for each in maps])),
        "error per 10 m expected within a factor of 2": _within_2(
            [each.errors.local_m for each in maps], [each.expected_local_m for each in maps], _LOCAL
        ),
        "error over all of the map, likewise": _within_2(
            [each.errors.whole_m for each in maps], [each.expected_whole_m for each in maps], _WHOLE
        ),
        f"wrong maps with a place named within {NEAR:g} m of the worst error": VerdictShare(
            _share([each.place_off_m is not None and each.place_off_m < NEAR for each in wrong]),
            _share([each.near_share for each in wrong]),
        ),
    }


def _within_2(true: Sequence[float], expected: Sequence[float], bounds: tuple[float, float]) -> VerdictShare:
    """The share of true errors within a factor of two of the expected ones.

    If one error is expected of all, the best choice is twice one of the true errors.
    """
    errors = np.clip(true, *bounds)

    def share(guesses: Sequence[float] | float) -> float:
        ratios = errors / np.clip(guesses, *bounds)
        return float(np.mean((ratios >= 0.5) & (ratios <= 2.0)))

    return VerdictShare(share(expected), max(share(2.0 * error) for error in errors))


def _share(are: Sequence[float]) -> float:
    return float(np.mean(are)) if are else float("nan")
