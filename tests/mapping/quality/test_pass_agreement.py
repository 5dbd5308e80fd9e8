"""Two passes through a room, of which the second may lie wrong in the map."""

import numpy as np
import pytest

from racecar.mapping.quality import pass_agreement
from racecar.mapping.quality.pass_agreement import PassAgreement, agreement_of, near_pairs
from racecar.sensors.matching.scan_store import ScanStore
from tests.mapping.quality.plain_maps import plain_map
from tests.sensors.worlds import ROOM, store_of

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
