"""Where something speaks against a map: passes that contradict each other, and ties that hold badly."""

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.constraints import constrain, pairs_along_path
from racecar.mapping.quality import pass_agreement
from racecar.mapping.quality.doubtful_segments import doubtful_segments
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.quality.pass_agreement import PassAgreement, agreement_of, near_pairs
from racecar.mapping.quality.statistics import measure, weakest_direction
from racecar.sensors.matching.scan_store import PreparedScan, ScanStore
from tests.mapping.sessions import chain, plain_map
from tests.sensors.worlds import CORRIDOR, ROOM, store_of

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
    assert worst.seconds == pytest.approx((0.5 * worst.keyframes[0], 0.5 * worst.keyframes[1]))
    assert "contradict each other" in worst.why


def test_the_stretch_that_is_tied_worst_is_named() -> None:
    scans = [c for c in by_scans() if not c.from_keyframe < 20 <= c.to_keyframe]
    (stretch,) = segments(TRUE, scans)
    assert stretch.keyframes[0] < 20 <= stretch.keyframes[1]
    assert "the path may be off by" in stretch.why


PASS = np.column_stack([np.linspace(-2.5, 0.0, 8), np.full(8, -0.5), np.linspace(0.0, 0.3, 8)])
PAIRS = np.array([(a, 8 + b) for a in range(8) for b in range(8)])


def two_passes(shift: tuple[float, float, float]) -> tuple[np.ndarray, ScanStore]:
    """Poses in the map and scans; the second pass is shifted in the map, though not in the room."""
    true = np.concatenate([PASS, PASS + np.array([0.2, 0.3, 0.05])])
    shifted = true.copy()
    shifted[8:] += np.array(shift)
    return shifted, store_of(ROOM, true)


def passes(shift: tuple[float, float, float]) -> PassAgreement:
    return agreement_of(PAIRS, *two_passes(shift))


def share_looked_through(shift: tuple[float, float, float]) -> float:
    return float(passes(shift).looked_through.sum() / passes(shift).judged.sum())


def test_passes_that_lie_right_agree() -> None:
    assert share_looked_through((0.0, 0.0, 0.0)) < 0.02


@pytest.mark.parametrize("shift", [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0)])
def test_a_pass_that_lies_wrong_looks_through_what_the_other_saw(shift: tuple[float, float, float]) -> None:
    assert share_looked_through(shift) > 0.2


def test_pairs_that_face_other_ways_are_judged() -> None:
    back_to_back = np.array([[-1.0, 0.0, 0.0], [-1.0, 0.2, np.pi]])
    store, pair = store_of(ROOM, back_to_back), np.array([[0, 1]])
    assert agreement_of(pair, back_to_back, store).judged[0] > 50


def agreement(bins: list[int], looked_through: list[int]) -> PassAgreement:
    """Of pairs of which 10 000 returns each could be judged."""
    count = len(bins)
    pairs = np.column_stack([np.arange(count), 100 + np.arange(count)])
    counts = np.array(looked_through, dtype=np.int64)
    return PassAgreement(pairs, np.array(bins, dtype=np.int64), counts, np.full(count, 10_000))


def test_passes_are_compared_with_neighbours_whose_viewpoints_lie_as_far_apart() -> None:
    neighbours = agreement([0, 0, 4, 4], [100, 100, 1000, 1000])
    usual = agreement([4, 0, 2], [0, 0, 0]).usual(neighbours)
    assert usual == pytest.approx([1000, 100, 550], rel=0.1)  # of bin 2 there is none: as of all


def test_where_there_are_no_neighbours_nothing_is_usual() -> None:
    assert agreement([1], [500]).usual(agreement([], [])).tolist() == [0.0]


def test_the_places_are_told_at_which_passes_contradict_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pass_agreement, "PLACE", 4.0)
    path = np.concatenate([np.arange(8) * 1.0, 100.0 + np.arange(8)])
    whole = passes((0.0, 0.4, 0.0))
    looked_through = np.where((whole.pairs == [[2, 10]]).any(axis=1), whole.looked_through, 0)
    some = PassAgreement(whole.pairs, whole.bins, looked_through, whole.judged)
    places = some.by_places(0.03 * whole.judged, path)
    assert len(places.judged) == 4
    assert places.judged.sum() == whole.judged.sum()
    assert places.usual == pytest.approx(0.03)
    first_of_each = places.of_pair[0]
    assert places.looked_through[first_of_each] > 0.1
    assert places.looked_through[places.of_pair[-1]] == 0.0


def test_neighbours_follow_each_other_and_passes_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    there = np.column_stack([np.arange(0.0, 8.0, 0.5), np.zeros(16), np.zeros(16)])
    poses = np.concatenate([there, there[::-1] + np.array([0.0, 0.5, np.pi])])
    map_ = plain_map(store_of(ROOM, 0.2 * poses), poses, [], np.arange(32.0))
    neighbours, passes = near_pairs(map_)
    assert len(neighbours)
    assert len(passes)
    driven = np.diff(map_.path[neighbours], axis=1)
    assert driven.max() <= 5.0
    assert np.diff(map_.path[passes], axis=1).min() > 5.0
    assert np.hypot(*(poses[passes[:, 0]] - poses[passes[:, 1]])[:, :2].T).max() <= 4.0
    monkeypatch.setattr(pass_agreement, "_MOST_NEIGHBOURS", 7)
    monkeypatch.setattr(pass_agreement, "_MOST_PASSES", 5)
    assert [len(pairs) for pairs in near_pairs(map_)] == [7, 5]


def test_of_no_pair_nothing_is_known() -> None:
    store = store_of(ROOM, PASS)
    none = agreement_of(np.zeros((0, 2), dtype=np.int64), PASS, store)
    assert len(none.by_places(none.usual(none), np.arange(8.0)).judged) == 0


PLACE = np.array([[-1.0, 0.0, 0.3]])


def test_a_room_holds_and_a_bare_corridor_does_not() -> None:
    assert weakest_direction(store_of(ROOM, PLACE))[0] > 0.1
    assert weakest_direction(store_of(CORRIDOR, PLACE))[0] < 0.01


def test_a_scan_that_saw_nothing_is_not_held() -> None:
    store = store_of(ROOM, PLACE)
    store.add(PreparedScan(np.zeros((0, 2), dtype=np.float32), np.zeros((0, 2), dtype=np.float32)))
    assert weakest_direction(store).tolist()[1] == 0.0
