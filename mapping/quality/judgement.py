"""The verdict: from statistics of a finished map to its expected error."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.doubtful_segments import doubtful_segments
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.jumps import MOST_JUMP
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.quality.pass_agreement import agreement_of, near_pairs
from racecar.mapping.quality.statistics import measure
from racecar.mapping.quality.unseen_motion import MOST_UNSEEN

MOST_UNLIKE = 0.3
"""Share of earlier drives' points that the last one may see through at most places. Measured where half of
the furniture was moved between drives: 0.1; with the last one 0.2 m off 0.26, with 0.5 m or 3 degrees 0.4 to
0.8."""
_LEAST = np.array([0.015, 0.06])
"""Metres per 10 m and over the whole that remain without any evidence against a map; measured, as are
`_THROUGH` and `_RESIDUAL`, on 161 maps of known error, see docs/measured/mapper.md. Not detected: a map that
is wrong everywhere alike, such as mirrored, and drift where nothing is passed twice."""
_OF_SPREAD = 0.8
"""Mean absolute error over standard deviation, by definition of the normal distribution."""
_THROUGH = 3.0
"""Metres per squared share of points seen through between passes; measured on the same maps."""
_RESIDUAL = 20.0
"""Metres per squared mean match residual in metres; measured on the same maps."""
_WRONG_FACTOR = 2.5
"""Expected error, relative to the limit of a good map, from which a map is wrong and not only doubtful.
Measured likewise."""
_MOST_SCALE = 1.25
"""Ratio of lengths by scans and by wheels from which either must be wrong. Chosen by judgement: worn tyres
and wrong settings make some per cent, scans that do not move make any. Good maps had 1.07 at most."""
_MOST_OVERRULED = 0.5
"""Share of steps in which scans may contradict the wheels. Chosen by judgement: wheels slip now and then, and
a robot is carried for a while."""
_WEIGHTY = 0.25
"""Share of the expected error from which a cause is reported, so that there are few."""
_WHY = {
    "passes": "Passes through the same place look through {looked_through_by_passes:.0%} more of what the "
    "other one saw than scans that follow each other.",
    "slip": "Where walls hold, wheels and map differ by {slip_share:.1%} of the way: where only wheels show "
    "how far the car came, the map is as wrong.",
    "spread": "What ties the path together leaves {spread_per_10_m:.2f} m per 10 m open, by its residuals, "
    "and {spread_of_whole:.2f} m over the whole map.",
    "matches": "Scans fit each other elsewhere than in the map, by {match_residual_m:.3f} m on average.",
}
"""Sentences for the causes of errors."""


def judge(map_: FinishedMap, config: QualityConfig) -> MapQuality:
    """Judge a finished map: its last drive, and its agreement with earlier ones."""
    last = map_.last_drive
    if len(last.poses) < 2:
        local, whole = _LEAST.tolist()  # a single place cannot contradict itself
        return MapQuality(Verdict.GOOD, local, whole, (), (), {})
    statistics = measure(last)
    figures = statistics.figures
    if last is not map_:
        figures = {**figures, "unlike_earlier": unlike_earlier(map_)}
    causes = _causes(figures)
    expected = np.maximum(_LEAST + causes["passes"] + causes["spread"] + causes["matches"], causes["slip"])
    local, whole = expected.tolist()
    excess = max(local / config.good_local, whole / config.good_whole)
    doubts = tuple(_doubts(map_.wheel_scale, figures))
    if excess <= 1.0 and not doubts:
        return MapQuality(Verdict.GOOD, local, whole, (), (), figures)
    found = doubtful_segments(last, statistics)
    segments = tuple(segment.shifted(map_.first_of_last_drive) for segment in found)
    shares = {name: float((metres / expected).max()) for name, metres in causes.items()}
    if any(segment.contradicted_by for segment in segments):
        del shares["passes"]  # the segments report them one by one, with their places
    weighty = [name for name in sorted(shares, key=lambda name: -shares[name]) if shares[name] >= _WEIGHTY]
    complaints = [_WHY[name].format_map(figures) for name in weighty if excess > 1.0]
    reasons = (*doubts, *complaints, *(segment.why for segment in segments))
    verdict = Verdict.WRONG if excess > _WRONG_FACTOR else Verdict.DOUBTFUL
    return MapQuality(verdict, local, whole, reasons, segments, figures, doubts)


def _causes(figures: Mapping[str, float]) -> dict[str, NDArray[np.float64]]:
    """(2,) expected error per cause, in metres per 10 m and over the whole: disagreeing passes, wheel slip,
    uncertainty of the graph, and residuals of matches."""
    through, residual = np.fmax([figures["looked_through_by_passes"], figures["match_residual_m"]], 0.0)
    return {
        "passes": np.full(2, _THROUGH * through**2),
        "slip": np.array([figures["slip_per_10_m"], figures["slip_of_whole"]]),
        "spread": _OF_SPREAD * np.array([figures["spread_per_10_m"], figures["spread_of_whole"]]),
        "matches": np.full(2, _RESIDUAL * residual**2),
    }


def _doubts(wheel_scale: float, figures: Mapping[str, float]) -> Iterator[str]:
    """Reasons to doubt a map whatever its expected error: scans and wheels that contradict each other in
    scale or in too many steps, a path that jumps, unobserved motion, or a drive merged at a wrong place."""
    unlike = figures.get("unlike_earlier", 0.0)
    if unlike > MOST_UNLIKE:
        yield (
            f"At most places that the drives share, one looks through {unlike:.0%} of what another saw: the "
            "last one was joined at a wrong place, or nearly everything was moved. Look at the map first."
        )
    if max(wheel_scale, 1.0 / max(wheel_scale, 1e-9)) > _MOST_SCALE:
        yield (
            f"By its scans the car drove {wheel_scale:.2f} times as far as by its wheels: one of the two is "
            "wrong."
        )
    elif (share := figures["slip_share"]) > _MOST_SCALE - 1.0:
        yield f"Where walls hold, wheels and map differ by {share:.0%} of the way: one of the two is wrong."
    elif (share := figures["overruled_wheels"]) > _MOST_OVERRULED:
        yield f"On {share:.0%} of the steps scans and wheels contradict each other: one is wrong."
    if figures["jump_m"] > MOST_JUMP:
        yield (
            f"The path jumps by {figures['jump_m']:.1f} m that the car cannot have driven: one side of the "
            "jump lies at a wrong place, as where places look alike."
        )
    if figures["unseen_way_m"] > MOST_UNSEEN:
        yield (
            "Between walls that would not show it moving along them the car seems to have stood, for as long "
            f"as it usually takes to go {figures['unseen_way_m']:.0f} m: if it did not, these are missing in "
            "the map."
        )


def unlike_earlier(map_: FinishedMap) -> float:
    """Median over places of the share of earlier drives' points that the last one sees through, or vice
    versa; NaN without common places.

    Objects are moved between drives, so at some places it sees through what was there before. A drive that
    was merged at a wrong place does so nearly everywhere.
    """
    _, pairs = near_pairs(map_)
    first = map_.first_of_last_drive
    of_both = pairs[(pairs[:, 0] < first) & (pairs[:, 1] >= first)]
    passes = agreement_of(of_both, map_.poses, map_.session.keyframes)
    places = passes.by_places(np.zeros(len(of_both)), map_.path)
    shares = places.looked_through[places.are_seen]
    return float(np.median(shares)) if len(shares) else float("nan")
