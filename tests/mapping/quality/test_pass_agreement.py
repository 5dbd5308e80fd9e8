"""Two passes through a room, of which the second may lie wrong in the map."""

import numpy as np
import pytest

from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.quality.config import PassAgreementConfig
from racecar.mapping.quality.pass_agreement import PassAgreement, agreement_of
from tests.mapping.worlds import ROOM, store_of

PASS = np.column_stack([np.linspace(-2.5, 0.0, 8), np.full(8, -0.5), np.linspace(0.0, 0.3, 8)])
PAIRS = np.array([(a, 8 + b) for a in range(8) for b in range(8)])


def passes(shift: tuple[float, float, float]) -> PassAgreement:
    """The second pass shifted in the map, though not in the room."""
    true = np.concatenate([PASS, PASS + np.array([0.2, 0.3, 0.05])])
    shifted = true.copy()
    shifted[8:] += np.array(shift)
    store: ScanStore = store_of(ROOM, true)
    return agreement_of(PAIRS, shifted, store, PassAgreementConfig())


def share(agreement: PassAgreement) -> float:
    return float(np.average(agreement.looked_through, weights=agreement.judged))


def test_passes_that_lie_right_agree() -> None:
    agreement = passes((0.0, 0.0, 0.0))
    assert share(agreement) < 0.02
    assert np.nanmax(agreement.walls_apart) < 0.02


@pytest.mark.parametrize("shift", [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0)])
def test_a_pass_that_lies_wrong_looks_through_what_the_other_saw(shift: tuple[float, float, float]) -> None:
    agreement = passes(shift)
    assert share(agreement) > 0.2
    assert np.nanmedian(agreement.walls_apart) > 0.15


def test_pairs_that_face_other_ways_are_not_matched_but_judged() -> None:
    back_to_back = np.array([[-1.0, 0.0, 0.0], [-1.0, 0.2, np.pi]])
    store = store_of(ROOM, back_to_back)
    agreement = agreement_of(np.array([[0, 1]]), back_to_back, store, PassAgreementConfig())
    assert np.isnan(agreement.walls_apart[0])
    assert agreement.judged[0] > 50


def test_the_places_are_told_at_which_passes_contradict_each_other() -> None:
    path = np.concatenate([np.arange(8) * 1.0, 100.0 + np.arange(8)])
    whole = passes((0.0, 0.4, 0.0))
    looked_through = np.where((whole.pairs == [[2, 10]]).any(axis=1), whole.looked_through, 0.0)
    agreement = PassAgreement(whole.pairs, looked_through, whole.judged, whole.walls_apart)
    places = agreement.by_places(path, 4.0)
    assert len(places.judged) == 4
    assert places.judged.sum() == whole.judged.sum()
    first_of_each = places.of_pair[0]
    assert places.looked_through[first_of_each] > 0.1
    assert places.looked_through[places.of_pair[-1]] == 0.0


def test_of_no_pair_nothing_is_known() -> None:
    store = store_of(ROOM, PASS)
    agreement = agreement_of(np.zeros((0, 2), dtype=np.int64), PASS, store, PassAgreementConfig())
    assert len(agreement.by_places(np.arange(8.0), 5.0).judged) == 0
