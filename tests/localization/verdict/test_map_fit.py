import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.map_fit import MapFit
from tests.localization.verdict.estimates import RIGHT, WRONG, estimate, straight_drive

margins = st.floats(-100.0, 100.0)


def fit_of(drive: list[PoseEstimate]) -> MapFit:
    fit = MapFit()
    for each in drive:
        fit.follow(each)
    return fit


def driven(seen: list[float]) -> MapFit:
    """Two metres for each margin."""
    return fit_of(
        [estimate(2.0 * k, 2.0 * k, margin=margin, is_start=k == 0) for k, margin in enumerate(seen)]
    )


def test_before_a_drive_nothing_is_known() -> None:
    fit = MapFit()
    assert not fit.is_right
    assert not fit.is_wrong


def test_scans_that_fit_better_nowhere_else_say_that_it_is_the_right_map() -> None:
    fit = fit_of(list(straight_drive(10.0, margin=RIGHT)))
    assert fit.is_right
    assert not fit.is_wrong


def test_scans_that_fit_better_elsewhere_say_that_it_is_a_wrong_one() -> None:
    fit = fit_of(list(straight_drive(10.0, margin=WRONG)))
    assert fit.is_wrong
    assert not fit.is_right


@given(st.lists(margins, min_size=1, max_size=50), st.integers(0, 49), st.floats(0.0, 50.0))
def test_a_larger_margin_never_speaks_against_the_map(seen: list[float], which: int, more: float) -> None:
    better = list(seen)
    better[which % len(seen)] += more
    assert driven(better).log_odds >= driven(seen).log_odds


@given(st.lists(margins, max_size=300))
def test_no_drive_is_more_than_sure(seen: list[float]) -> None:
    assert abs(driven(seen).log_odds) < 20.0


@pytest.mark.parametrize("margin", [RIGHT, WRONG])
@pytest.mark.parametrize("metres", [0.0, 1.0])
def test_a_car_that_stands_where_it_was_found_is_not_beyond_doubt(margin: float, metres: float) -> None:
    """However long; also if it has driven no farther than a metre before."""
    drive = list(straight_drive(metres, margin=margin))
    drive += [estimate(metres + k, metres, margin=margin, is_start=metres == k == 0) for k in range(100)]
    fit = fit_of(drive)
    assert not fit.is_right
    assert not fit.is_wrong
