"""The scan that fits worst, and scans evenly along the path, however long the car stood."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.files.pictures.moments import Moment, MomentsAlong

METRE_PER_SCAN = 0.05


def moment(number: int, metres: float = 0.0, share: float = np.nan) -> Moment:
    return Moment(number, np.array([metres, 0.0, 0.0]), np.empty((0, 2)), share)


def places(metres: list[float], count: int = 6) -> list[float]:
    """Where the chosen moments were taken, metres along the path, and that they are in order."""
    along = MomentsAlong(count)
    for stamp, each in enumerate(metres):
        along.add(each, moment(stamp, each), is_known=True)
    stamps = [moment.stamp for moment in along.moments]
    assert stamps == sorted(set(stamps))
    return [float(moment.map_from_base[0]) for moment in along.moments]


def test_standing_takes_no_moments() -> None:
    drive = [METRE_PER_SCAN * scan for scan in range(1200)]
    stood = [*drive[:300], *[drive[300]] * 5000, *drive[300:], *[drive[-1]] * 9000]
    wanted = np.arange(1, 7) / 6 * drive[-1]
    np.testing.assert_allclose(places(drive), wanted, atol=1.5)
    np.testing.assert_allclose(places(stood), wanted, atol=1.5)


def test_a_car_that_only_stands_is_seen_over_the_time() -> None:
    along = MomentsAlong(6)
    for stamp in range(1200):
        along.add(0.0, moment(stamp), is_known=True)
    wanted = np.arange(1, 7) / 6 * 1200
    np.testing.assert_allclose([moment.stamp for moment in along.moments], wanted, atol=40)


def test_short_drives_show_what_there_is() -> None:
    assert places([]) == []
    assert places([0.0]) == [0.0]
    assert places([0.0, 1.0, 2.0]) == [0.0, 1.0, 2.0]


@given(st.lists(st.floats(0.0, 1.0) | st.just(np.nan), min_size=1, max_size=300), st.integers(2, 8))
def test_the_worst_comes_first_and_the_end_last(shares: list[float], count: int) -> None:
    along = MomentsAlong(count)
    for number, share in enumerate(shares):
        along.add(METRE_PER_SCAN * number, moment(number, share=share), is_known=True)
    chosen = [each.stamp for each in along.moments]
    assert len(set(chosen)) == len(chosen) <= count
    assert max(chosen) == len(shares) - 1
    if not np.isnan(shares).all():
        assert shares[chosen[0]] == np.nanmin(shares)
        chosen = chosen[1:]
    assert chosen == sorted(chosen)


def test_before_the_place_is_known_nothing_fits_badly() -> None:
    along = MomentsAlong(3)
    for number, (share, is_known) in enumerate([(0.1, False), (0.8, True), (0.5, False), (0.9, True)]):
        along.add(float(number), moment(number, share=share), is_known=is_known)
    assert along.moments[0].stamp == 2


def test_of_a_drive_that_is_never_localized_the_worst_counts() -> None:
    along = MomentsAlong(3)
    for number, share in enumerate([0.3, 0.1, 0.2]):
        along.add(float(number), moment(number, share=share), is_known=False)
    assert along.moments[0].stamp == 1
