"""Where something speaks against a map."""

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.constraints import constrain, pairs_along_path
from racecar.mapping.quality.doubtful_segments import doubtful_segments
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.quality.statistics import measure
from tests.mapping.quality.plain_maps import chain, plain_map
from tests.sensors.worlds import ROOM, store_of

THERE = np.column_stack([np.linspace(-3.0, 0.5, 15), np.full(15, -0.6), np.zeros(15)])
AND_BACK = np.column_stack([np.linspace(0.5, -3.0, 15), np.full(15, 0.2), np.full(15, np.pi)])
TRUE = np.concatenate([THERE, AND_BACK])
WHEELS = np.diag([30.0, 30.0, 60.0])


def segments(mapped: np.ndarray, tied: list[Constraint]) -> tuple[DoubtfulSegment, ...]:
    """Of a drive through the room whose keyframes were mapped to (K, 3)."""
    map_ = plain_map(store_of(ROOM, TRUE), mapped, tied, 0.5 * np.arange(len(TRUE)))
    return doubtful_segments(map_, measure(map_))


def by_scans() -> list[Constraint]:
    return constrain(pairs_along_path(range(len(TRUE))), TRUE, store_of(ROOM, TRUE))


def test_nothing_speaks_against_a_right_map() -> None:
    assert segments(TRUE, [*by_scans(), *chain(TRUE, WHEELS, "odometry")]) == ()


def test_passes_that_contradict_each_other_are_named_with_both_times() -> None:
    mapped = TRUE.copy()
    mapped[15:, 0] += 0.5
    named = [s for s in segments(mapped, by_scans()) if s.contradicted_by is not None]
    assert named
    worst = named[0]
    assert worst.contradicted_by is not None
    assert worst.contradicted_by[1] < 15 <= worst.keyframes[1]
    assert worst.seconds == (0.5 * worst.keyframes[0], 0.5 * worst.keyframes[1])
    assert "contradict each other" in worst.why


def test_the_stretch_that_is_tied_worst_is_named() -> None:
    scans = [c for c in by_scans() if not c.from_keyframe < 20 <= c.to_keyframe]
    (stretch,) = segments(TRUE, scans)
    assert stretch.keyframes[0] < 20 <= stretch.keyframes[1]
    assert "the path may be off by" in stretch.why
