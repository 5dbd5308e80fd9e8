"""Scans evenly along the path, however long the car stood."""

import numpy as np

from racecar.pipelines.files.pictures.moments import Moment, MomentsAlong

METRE_PER_SCAN = 0.05


def places(metres: list[float], count: int = 6) -> list[float]:
    """Where the chosen moments were taken, metres along the path, and that they are in order."""
    along = MomentsAlong(count)
    for stamp, each in enumerate(metres):
        along.add(each, Moment(stamp, np.array([each, 0.0, 0.0]), np.empty((0, 2)), np.nan))
    stamps = [moment.stamp for moment in along.moments]
    assert stamps == sorted(set(stamps))
    return [float(moment.map_from_base[0]) for moment in along.moments]


def test_standing_takes_no_moments() -> None:
    drive = [METRE_PER_SCAN * scan for scan in range(1200)]
    stood = [*drive[:300], *[drive[300]] * 5000, *drive[300:], *[drive[-1]] * 9000]
    wanted = (np.arange(6) + 0.5) / 6 * drive[-1]
    np.testing.assert_allclose(places(drive), wanted, atol=1.5)
    np.testing.assert_allclose(places(stood), wanted, atol=1.5)


def test_a_car_that_only_stands_is_seen_over_the_time() -> None:
    along = MomentsAlong(6)
    for stamp in range(1200):
        along.add(0.0, Moment(stamp, np.zeros(3), np.empty((0, 2)), np.nan))
    wanted = (np.arange(6) + 0.5) / 6 * 1200
    np.testing.assert_allclose([moment.stamp for moment in along.moments], wanted, atol=40)


def test_short_drives_show_what_there_is() -> None:
    assert places([]) == []
    assert places([0.0]) == [0.0]
    assert places([0.0, 1.0, 2.0]) == [0.0, 1.0, 2.0]
