"""Locate what contradicts a map: passes that disagree, stretches with few constraints.

The wrong step itself cannot be seen, or the mapper would not have made it. It is between two passes that
disagree, most likely where the path between is least constrained.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from racecar.mapping.keyframes.first_pass import are_between_passes
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.jumps import MOST_JUMP
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.quality.statistics import MapStatistics
from racecar.mapping.quality.unseen_motion import MOST_UNSEEN

_MOST_OF_A_KIND = 3
"""Reported segments of each kind at most, because nobody reads more."""
_LEAST_SHARE = 0.05
"""Share seen through, in excess of that of neighbours, from which two passes disagree. Chosen by judgement:
people and doors make less."""
_LEAST_OPEN = 0.1
"""Metres of uncertainty from which a stretch is reported. Chosen by judgement: two cells of the map."""
_FIRST = 1000.0
"""A weight above that of any contradiction that can be measured; chosen by judgement."""


_Weighed = tuple[float, DoubtfulSegment]
"""Weight of the evidence against a segment, relative to the usual, and the segment."""


def doubtful_segments(map_: FinishedMap, statistics: MapStatistics) -> tuple[DoubtfulSegment, ...]:
    """All segments, heaviest first."""
    kinds = (_contradictions, _open_stretches, _unseen_motion, _jumps)
    chosen = [weighed for kind in kinds for weighed in _heaviest(kind(map_, statistics))[:_MOST_OF_A_KIND]]
    return tuple(segment for _, segment in _heaviest(chosen))


def _heaviest(segments: Iterable[_Weighed]) -> list[_Weighed]:
    return sorted(segments, key=lambda weighed: -weighed[0])


def _contradictions(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Pairs of passes of which one sees through what the other saw, more than neighbours do."""
    passes, places = statistics.passes, statistics.places
    share = places.looked_through
    beyond = share - places.usual
    contradict = places.are_seen & (beyond > _LEAST_SHARE)
    for b in np.flatnonzero(contradict).tolist():
        is_here = places.of_pair == b
        first, second = ((int(ends.min()), int(ends.max())) for ends in passes.pairs[is_here].T)
        others = (
            f"{share[b]:.0%} of what one saw the other looks through, {places.usual[b]:.0%} would be usual"
        )
        where = f"passes {_when(map_, first)} and {_when(map_, second)} contradict each other"
        segment = _segment(map_, f"Near {_at(map_, second)} the {where}: {others}.", second, first)
        yield beyond[b] / _LEAST_SHARE, segment


def _open_stretches(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """The most uncertain stretches that do not overlap."""
    named: list[tuple[int, int]] = []
    for k in np.argsort(-statistics.open, kind="stable").tolist():
        first, last = statistics.stretches[k].tolist()
        metres = float(statistics.open[k])
        if metres < _LEAST_OPEN or len(named) == _MOST_OF_A_KIND:
            return
        if all(last <= begin or first >= end for begin, end in named):
            named.append((first, last))
            where = f"From {_at(map_, (first, first))} to {_at(map_, (last, last))}"
            why = f"{where}, {_when(map_, (first, last))}, the path may be off by {metres:.2f} m."
            yield metres / _LEAST_OPEN, _segment(map_, why, (first, last))


def _unseen_motion(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Steps in which the car seems to stand, but no wall would show motion. They come first, as only the user
    can settle them."""
    metres = statistics.unseen_motion
    for k in np.flatnonzero(metres > MOST_UNSEEN).tolist():
        run = (k, k + 1)
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, the car may have moved unseen."
        yield _FIRST + metres[k] / MOST_UNSEEN, _segment(map_, why, run)


def _jumps(map_: FinishedMap, statistics: MapStatistics) -> Iterator[_Weighed]:
    """Steps that no car can drive: the map before or after them is certainly wrong."""
    beyond = statistics.jumps
    for k in np.flatnonzero(beyond > MOST_JUMP).tolist():
        run, other = (k, k + 1), None
        why = f"Near {_at(map_, run)}, {_when(map_, run)}, the path jumps by {beyond[k]:.1f} m."
        if (loop := _nearest_loop(map_, k)) is not None:
            run, other = ((end, end) for end in loop)
            why += f" The nearest loop connects the passes {_when(map_, run)} and {_when(map_, other)}."
        yield _FIRST + beyond[k] / MOST_JUMP, _segment(map_, why, run, other)


def _nearest_loop(map_: FinishedMap, step: int) -> tuple[int, int] | None:
    """Keyframes of different passes that scans connect, first the one nearest to a step along the path."""
    constraints = map_.session.constraints
    ends = constraints.ends[are_between_passes(constraints, map_.session.times.numbers)]
    if len(ends) == 0:
        return None
    away = np.abs(map_.path[ends] - map_.path[step])
    nearest, side = np.unravel_index(int(np.argmin(away)), away.shape)
    return int(ends[nearest, side]), int(ends[nearest, 1 - side])


def _segment(
    map_: FinishedMap, why: str, run: tuple[int, int], contradicted_by: tuple[int, int] | None = None
) -> DoubtfulSegment:
    first, last = map_.seconds[list(run)].tolist()
    return DoubtfulSegment(why, run, map_.poses[sum(run) // 2, :2].copy(), (first, last), contradicted_by)


def _when(map_: FinishedMap, run: tuple[int, int]) -> str:
    first, last = map_.seconds[list(run)]
    times = map_.session.times
    name = times.recordings[times.numbers[run[0]]].name if len(times.recordings) > 1 else ""
    of_recording = f" of {name}" if name else ""
    span = f"{first:.0f} s" if last - first < 1.0 else f"{first:.0f} to {last:.0f} s"
    return f"at {span}{of_recording}"


def _at(map_: FinishedMap, run: tuple[int, int]) -> str:
    x, y = map_.poses[sum(run) // 2, :2]
    return f"x {x:.1f} m, y {y:.1f} m"
