import numpy as np
import pytest

from racecar.mapping.session.recordings import KeyframeTimes, Recording

FIRST = KeyframeTimes.of(Recording("one", 1_000_000_000, 5_000_000_000), np.array([2, 3]) * 1_000_000_000)
SECOND = KeyframeTimes.of(Recording("two", 8_000_000_000, 9_000_000_000), np.array([8]) * 1_000_000_000)


def test_seconds_count_from_the_begin_of_each_recording() -> None:
    both = FIRST.followed_by(SECOND, is_newer=True)
    np.testing.assert_allclose(both.seconds, [1.0, 2.0, 0.0])
    assert both.are_of_last.tolist() == [False, False, True]


@pytest.mark.parametrize(("is_newer", "drives"), [(True, [0, 0, 1, 2]), (False, [1, 1, 0, 1])])
def test_a_newer_recording_ranks_after_the_earlier_ones(is_newer: bool, drives: list[int]) -> None:
    later = SECOND.followed_by(SECOND, is_newer=True)
    joined = FIRST.followed_by(later, is_newer=is_newer)
    assert joined.drives.tolist() == drives


def test_a_recording_is_remembered_when_none_of_its_keyframes_remains() -> None:
    left = FIRST.followed_by(SECOND, is_newer=True).only(np.array([False, False, True]))
    assert [each.name for each in left.recordings] == ["one", "two"]
    assert left.seconds.tolist() == [0.0]


def test_the_arrays_of_a_file_hold_all_of_it() -> None:
    both = FIRST.followed_by(SECOND, is_newer=True)
    again = KeyframeTimes.from_arrays(both.to_arrays())
    assert again.recordings == both.recordings
    np.testing.assert_array_equal(again.stamps, both.stamps)
    np.testing.assert_array_equal(again.drives, both.drives)
