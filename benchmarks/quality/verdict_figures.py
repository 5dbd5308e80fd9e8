"""How often verdicts were right, counted."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from benchmarks.quality.quality_benchmark import NEAR, JudgedMap
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.map_quality import Verdict

TRUE_KINDS = ("good", "between", "wrong")
_WRONG_FACTOR = 3.0
"""By what factor the error of a map exceeds that of a good one when it is wrong beyond dispute: three times,
by definition of the figures."""
_LOCAL, _WHOLE = (0.03, 1.0), (0.1, 5.0)
"""Metres, below and above which expected and true errors count as the same: references err as much as the
first, and a map that errs by the second, ten times what a good one may, is useless by however much."""


@dataclass(frozen=True)
class VerdictFigures:
    """Of some maps; shares are NaN where there is nothing to take them of."""

    counts: dict[str, dict[str, int]]
    """By what the map is (`TRUE_KINDS`), then by what the verdict says."""
    wrong_called_good: float
    """Share of the wrong maps."""
    good_called_wrong: float
    """Share of the good ones."""
    doubtful: float
    """Share of all."""
    local_within_2: float
    """Share of all maps whose error per 10 m is within a factor of two of what was expected."""
    local_within_2_by_constant: float
    """The same where one error is expected of all maps, the best one."""
    whole_within_2: float
    """Share of all maps whose error over all of the map is within a factor of two of what was expected."""
    whole_within_2_by_constant: float
    """The same where one error is expected of all maps, the best one."""
    place_found: float
    """Share of the wrong maps, called as they may be, in which a place was named near the worst error."""
    place_found_by_chance: float
    """Share of all places in the wrong maps that lie as near one that was named."""
    judging_seconds: float
    """The longest."""

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return asdict(self)


def kind_of(judged: JudgedMap, config: QualityConfig) -> str:
    """What a map truly is."""
    excess = max(judged.errors.local_m / config.good_local, judged.errors.whole_m / config.good_whole)
    return TRUE_KINDS[int(excess > 1.0) + int(excess > _WRONG_FACTOR)]


def verdict_figures(maps: Sequence[JudgedMap], config: QualityConfig) -> VerdictFigures:
    """Count maps, at least one."""
    counts = {kind: {verdict.value: 0 for verdict in Verdict} for kind in TRUE_KINDS}
    for judged in maps:
        counts[kind_of(judged, config)][judged.verdict] += 1
    wrong = [judged for judged in maps if kind_of(judged, config) == "wrong"]
    true_local, true_whole = [m.errors.local_m for m in maps], [m.errors.whole_m for m in maps]
    return VerdictFigures(
        counts=counts,
        wrong_called_good=_share([judged.verdict == "good" for judged in wrong]),
        good_called_wrong=_share([m.verdict == "wrong" for m in maps if kind_of(m, config) == "good"]),
        doubtful=_share([judged.verdict == "doubtful" for judged in maps]),
        local_within_2=_within_2(true_local, [m.expected_local_m for m in maps], _LOCAL),
        local_within_2_by_constant=_within_2_by_constant(true_local, _LOCAL),
        whole_within_2=_within_2(true_whole, [m.expected_whole_m for m in maps], _WHOLE),
        whole_within_2_by_constant=_within_2_by_constant(true_whole, _WHOLE),
        place_found=_share([m.place_off_m is not None and m.place_off_m < NEAR for m in wrong]),
        place_found_by_chance=_share([m.near_share for m in wrong]),
        judging_seconds=max(judged.judging_seconds for judged in maps),
    )


def _within_2(true: Sequence[float], expected: Sequence[float], bounds: tuple[float, float]) -> float:
    """Share of the true errors that are within a factor of two of what is expected."""
    ratios = np.clip(true, *bounds) / np.clip(expected, *bounds)
    return float(np.mean((ratios >= 0.5) & (ratios <= 2.0)))


def _within_2_by_constant(true: Sequence[float], bounds: tuple[float, float]) -> float:
    """The same where one error is expected of all: the best is twice one of them."""
    return max(_within_2(true, [2.0 * each] * len(true), bounds) for each in np.clip(true, *bounds))


def _share(are: Sequence[float]) -> float:
    return float(np.mean(are)) if are else float("nan")
