import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.recovery.place_judge import USUAL_FIT, PlaceJudge

SUREST = 1.0 / (1.0 + np.exp(6.0))
GOOD, BAD = 0.85, 0.2

fits = st.floats(0.0, 1.0)
seconds = st.floats(0.0, 1e6)
scans = st.lists(st.tuples(fits, seconds), max_size=60)


def judge_of(seen: list[tuple[float, float]]) -> PlaceJudge:
    judge = PlaceJudge()
    for fit, passed in seen:
        judge.judge(fit, passed)
    return judge


def test_before_any_scan_it_may_be_either() -> None:
    assert PlaceJudge().probability_lost == 0.5


@given(scans, st.tuples(fits, fits).map(sorted))
def test_a_scan_that_fits_better_never_says_more_that_the_car_is_elsewhere(
    seen: list[tuple[float, float]], pair: list[float]
) -> None:
    judge = judge_of(seen)
    assert judge.evidence(pair[0]) <= judge.evidence(pair[1])
    worse, better = judge.for_another_place(), judge.for_another_place()
    worse.judge(pair[0], 0.1)
    better.judge(pair[1], 0.1)
    assert better.probability_lost <= worse.probability_lost


@given(scans, st.floats(-1e3, 1e3), seconds)
def test_its_odds_are_bounded_whatever_it_sees(
    seen: list[tuple[float, float]], margin: float, passed: float
) -> None:
    judge = judge_of(seen)
    judge.compare(margin, passed)
    assert SUREST - 1e-9 <= judge.probability_lost <= 1.0 - SUREST + 1e-9


@given(scans, st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)).map(sorted))
def test_so_it_is_with_what_fits_better_here_than_elsewhere(
    seen: list[tuple[float, float]], pair: list[float]
) -> None:
    lost = []
    for margin in pair:
        judge = judge_of(seen)
        judge.compare(margin, 0.1)
        lost.append(judge.probability_lost)
    assert lost[1] <= lost[0]


@pytest.mark.parametrize("period", [0.025, 0.2])
def test_it_is_sure_within_a_second_and_changes_its_mind_as_soon(period: float) -> None:
    second = round(1.0 / period)
    judge = judge_of([(GOOD, period)] * 30 * second)
    assert judge.probability_lost == pytest.approx(SUREST)
    for fit, is_lost in ((BAD, True), (GOOD, False)):
        for _ in range(2 * second):
            judge.judge(fit, period)
        assert (judge.probability_lost > 0.9) == is_lost
        assert (judge.probability_lost < 0.1) != is_lost


def test_no_single_scan_decides() -> None:
    for fit in (0.0, 1.0):
        assert 0.02 < judge_of([(fit, 1 / 40)]).probability_lost < 0.7


@settings(max_examples=30)
@given(st.floats(0.25, 1e9), fits)
def test_after_a_pause_a_scan_counts_no_more_than_a_quarter_of_a_second(pause: float, fit: float) -> None:
    assert judge_of([(fit, pause)]).probability_lost == judge_of([(fit, 0.25)]).probability_lost


def break_even(judge: PlaceJudge) -> float:
    """The fit that says nothing."""
    return float(np.interp(0.0, [judge.evidence(0.0), judge.evidence(1.0)], [0.0, 1.0]))


def test_on_a_map_that_is_out_of_date_less_is_asked_of_a_scan() -> None:
    """Learned while the place is right beyond doubt, and known of the next place, too."""
    new = PlaceJudge()
    learned = judge_of([(0.62, 0.1)] * 600)
    assert learned.probability_lost < 0.01
    assert break_even(learned) / break_even(new) == pytest.approx(0.62 / USUAL_FIT, abs=0.02)
    other = learned.for_another_place()
    assert other.probability_lost == 0.5
    assert break_even(other) == break_even(learned)


@given(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=300))
def test_where_it_is_in_doubt_nothing_is_learned(bad: list[float]) -> None:
    judge = judge_of([(fit, 0.1) for fit in bad])
    assert break_even(judge) == break_even(PlaceJudge())


def test_what_one_for_another_place_sees_is_its_own() -> None:
    judge = judge_of([(GOOD, 0.1)] * 50)
    before = judge.probability_lost
    judge.for_another_place().judge(BAD, 0.2)
    assert judge.probability_lost == before
