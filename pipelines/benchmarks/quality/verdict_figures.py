"""How often verdicts were right, counted."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.map_quality import Verdict
from racecar.pipelines.benchmarks.quality.quality_benchmark import JudgedMap

TRUE_KINDS = ("good", "between", "wrong")
_WRONG_FACTOR = 3.0
"""By what factor the error of a map exceeds that of a good one when it is wrong beyond dispute: three times,
by definition of the figures."""
_LOCAL, _WHOLE = (0.03, 1.0), (0.1, 5.0)
"""Metres, below and above which expected and true errors count as the same: references err as much as the
first, and a map that errs by the second, ten times what a good one may, is useless by however much."""
_NEAR = 10.0
"""Metres between a place that was named and the worst error, within which it was found; by judgement: it is
in view."""


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
    whole_within_2: float
    """The same of the error over all of the map."""
    place_found: float
    """Share of the wrong maps, called as they may be, in which a place was named near the worst error."""
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
    return VerdictFigures(
        counts=counts,
        wrong_called_good=_share([judged.verdict == "good" for judged in wrong]),
        good_called_wrong=_share([m.verdict == "wrong" for m in maps if kind_of(m, config) == "good"]),
        doubtful=_share([judged.verdict == "doubtful" for judged in maps]),
        local_within_2=_share([_are_alike(m.errors.local_m, m.expected_local_m, _LOCAL) for m in maps]),
        whole_within_2=_share([_are_alike(m.errors.whole_m, m.expected_whole_m, _WHOLE) for m in maps]),
        place_found=_share([m.place_off_m is not None and m.place_off_m < _NEAR for m in wrong]),
        judging_seconds=max(judged.judging_seconds for judged in maps),
    )


def _are_alike(true: float, expected: float, bounds: tuple[float, float]) -> bool:
    ratio = min(max(true, bounds[0]), bounds[1]) / min(max(expected, bounds[0]), bounds[1])
    return 0.5 <= ratio <= 2.0


def _share(are: Sequence[bool]) -> float:
    return float(np.mean(are)) if are else float("nan")
