"""Where something speaks against a map: passes that contradict each other, steps that little ties.

The wrong step itself cannot be seen, or the mapper would not have made it; it lies between two passes that
contradict each other, and most likely where the path in between is tied worst.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.jumps import MOST_JUMP
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.quality.pass_agreement import PLACE
from racecar.mapping.quality.statistics import MapStatistics
from racecar.mapping.quality.unseen_stands import MOST_UNSEEN_WAY

_MOST_OF_A_KIND = 3
"""Segments that are named of each kind at most, because nobody reads more."""
_LEAST_SHARE = 0.05
"""Share looked through, beyond what neighbours look through of each other, from which two passes contradict
each other. By judgement: people and doors make less."""
_LEAST_APART = 0.1
"""Metres from which wheels and map are said to differ, because two cells of the map show."""
_SURPRISING = 4.0
"""By what factor a window must exceed the usual difference of wheels and map to be named. By judgement:
floors and turns make some."""
_LEAST_SLACK = 0.15
"""Metres of standard deviation from which scans do not tie a step. By judgement: three cells of the map,
while walls hold it to millimetres."""
_FIRST = 1000.0
"""A weight beyond that of any contradiction that can be measured; by judgement."""


@dataclass(frozen=True, eq=False)
class _Weighed:
    """A segment, and how much speaks against it in units of what is usual."""

    weight: float
    segment: DoubtfulSegment


def doubtful_segments(map_: FinishedMap, statistics: MapStatistics) -> tuple[DoubtfulSegment, ...]:
    """Those of most weight first."""
    kinds = (_contradictions, _loose_steps, _wheel_conflicts, _unseen_stands, _jumps)
    found = [list(kind(map_, statistics)) for kind in kinds]
    chosen = [w for each in found for w in sorted(each, key=lambda w: -w.weight)[:_MOST_OF_A_KIND]]
    return tuple(w.segment for w in sorted(chosen, key=lambda w: -w.weight))


def _contradictions(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Pairs of passes of which one looks through what the other saw, beyond what neighbours do."""
    passes, places = statistics.passes, statistics.places
    share = places.looked_through
    beyond = share - places.usual
    contradict = places.are_seen & (beyond > _LEAST_SHARE)
    for b in np.flatnonzero(contradict).tolist():
        is_here = places.of_pair == b
        first, second = (_range(ends) for ends in passes.pairs[is_here].T)
        others = (
            f"{share[b]:.0%} of what one saw the other looks through, {places.usual[b]:.0%} would be usual"
        )
        where = f"passes {_when(map_, first)} and {_when(map_, second)} contradict each other"
        segment = _segment(map_, f"Near {_at(map_, second)} the {where}: {others}.", second, first)
        yield _Weighed(beyond[b] / _LEAST_SHARE, segment)


def _loose_steps(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Runs of steps that scans hardly tie."""
    slack = statistics.ties.by_scans
    for start, end in _runs(slack > _LEAST_SLACK):
        worst = float(np.max(slack[start:end]))
        by_all = float(np.max(statistics.ties.by_all[start:end]))
        what = "only the wheels tie" if by_all < _LEAST_SLACK else "neither scans nor wheels tie well"
        run = (start, end)
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, {what} the path together."
        length = map_.path[end] - map_.path[start]
        weight = worst / _LEAST_SLACK * (1.0 + length / PLACE)
        yield _Weighed(float(np.log1p(weight)), _segment(map_, why, run))


def _wheel_conflicts(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Windows over which wheels and map differ by much more than usual."""
    wheels = statistics.wheels
    if len(wheels.metres) == 0:
        return
    limit = max(_LEAST_APART, _SURPRISING * float(np.median(wheels.metres)))
    for k in np.flatnonzero(wheels.metres > limit).tolist():
        first, last = wheels.keyframes[k].tolist()
        run = (first, last)
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, wheels and map differ by {wheels.metres[k]:.2f} m."
        yield _Weighed(float(wheels.metres[k] / limit), _segment(map_, why, run))


def _unseen_stands(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Steps in which the car stood by its wheels, and nothing else tells whether it did; of all that is
    doubtful, the user alone can settle these, so they come first."""
    stands = statistics.unseen_stands
    for k in np.flatnonzero(stands > MOST_UNSEEN_WAY).tolist():
        run = (k, k + 1)
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, the car may have been carried unseen."
        yield _Weighed(_FIRST + float(stands[k] / MOST_UNSEEN_WAY), _segment(map_, why, run))


def _jumps(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Steps that no car drives, so that what lies before or after them is wrong for certain."""
    beyond = statistics.jumps
    for k in np.flatnonzero(beyond > MOST_JUMP).tolist():
        run = (k, k + 1)
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, the path jumps by {beyond[k]:.1f} m."
        yield _Weighed(_FIRST + float(beyond[k] / MOST_JUMP), _segment(map_, why, run))


def _segment(
    map_: FinishedMap, why: str, run: tuple[int, int], contradicted_by: tuple[int, int] | None = None
) -> DoubtfulSegment:
    seconds = map_.seconds[list(run)]
    times = None if np.isnan(seconds).any() else (float(seconds[0]), float(seconds[1]))
    return DoubtfulSegment(why, run, map_.poses[sum(run) // 2, :2].copy(), times, contradicted_by)


def _range(keyframes: NDArray[np.int64]) -> tuple[int, int]:
    return int(keyframes.min()), int(keyframes.max())


def _when(map_: FinishedMap, run: tuple[int, int]) -> str:
    first, last = map_.seconds[list(run)]
    if np.isnan(first) or np.isnan(last):
        return "of an earlier drive"
    return f"at {first:.0f} s" if last - first < 1.0 else f"at {first:.0f} to {last:.0f} s"


def _at(map_: FinishedMap, run: tuple[int, int]) -> str:
    x, y = map_.poses[sum(run) // 2, :2]
    return f"x {x:.1f} m, y {y:.1f} m"


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where flags (N,) are set: the first index, and the one after the last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
