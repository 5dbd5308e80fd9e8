import numpy as np
import pytest

from racecar.mapping.keyframes import drive as drive_module
from racecar.mapping.keyframes.drive import Drive
from racecar.maps.geometry.se2 import IDENTITY, compose

BY_WHEELS, BY_SCANS, STEADY = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
NO_POINTS = np.zeros((0, 2))


def drive_with(guesses: np.ndarray, at_keyframe: np.ndarray, chosen: int) -> np.ndarray:
    """Where a scan between two keyframes is guessed to be; both are at the same place, as odometry says."""
    drive = Drive()
    drive.start_keyframe(np.zeros((1, 3)), 0)
    drive.add(0, NO_POINTS, np.zeros((1, 3)))
    drive.add(1, NO_POINTS, guesses)
    drive.start_keyframe(at_keyframe, chosen)
    drive.add(2, NO_POINTS, np.zeros((1, 3)))
    return drive.guess(np.array([1]), np.array([IDENTITY, at_keyframe[chosen]]))[0]


def test_scans_between_keyframes_lie_where_the_guess_that_was_right_tells() -> None:
    guesses = np.array([BY_WHEELS, BY_SCANS, STEADY])
    for chosen in range(3):
        assert np.array_equal(drive_with(guesses, guesses, chosen), guesses[chosen])


def test_a_scan_of_which_wheels_told_nothing_goes_by_the_same_guess_as_its_neighbours() -> None:
    at_keyframe = np.array([BY_WHEELS, BY_SCANS, STEADY])
    assert np.array_equal(drive_with(np.array([BY_SCANS, STEADY]), at_keyframe, 1), BY_SCANS)
    assert np.array_equal(drive_with(np.array([BY_SCANS, STEADY]), at_keyframe, 2), STEADY)
    assert np.array_equal(drive_with(np.array([BY_SCANS, STEADY]), at_keyframe, 0), BY_SCANS)


def test_a_scan_of_which_wheels_told_goes_by_scans_where_they_tell_nothing_of_the_keyframe() -> None:
    guesses = np.array([BY_WHEELS, BY_SCANS, STEADY])
    assert np.array_equal(drive_with(guesses, np.array([BY_SCANS, STEADY]), 0), BY_SCANS)


def test_the_returns_of_scans_between_keyframes_are_kept() -> None:
    drive = Drive()
    for index in range(6):
        if index in (0, 3):
            drive.start_keyframe(np.zeros((1, 3)), 0)
        drive.add(index, np.full((2, 2), float(index)), np.zeros((1, 3)))
    assert drive.held_scans.tolist() == [1, 2, 4, 5]
    assert [drive.clouds[scan][:, 0].tolist() for scan in drive.held_scans] == [[k, k] for k in (1, 2, 4, 5)]
    assert drive.keyframe_of(np.arange(6)).tolist() == [0, 0, 0, 1, 1, 1]


def test_of_a_car_that_stands_not_all_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_module, "_MOST_HELD", 3)
    drive = Drive()
    drive.start_keyframe(np.zeros((1, 3)), 0)
    for index in range(8):
        drive.add(index, np.ones((2, 2)), np.zeros((1, 3)))
    assert drive.held_scans.tolist() == [1, 2, 3]
    assert len(drive) == 8


def test_scans_that_were_given_up_stay_where_they_were_found() -> None:
    drive, step = Drive(), np.array([[1.0, 0.0, 0.0]])
    for index in range(9):
        if index % 3 == 0:
            drive.start_keyframe(step, 0)
        drive.add(index, np.ones((2, 2)), (index % 3) / 3 * step)
    map_from_keyframe = np.array([[0.0, 0.0, 0.0], [1.1, 0.1, 0.3], [2.0, 0.5, 0.4]])
    found = np.array([[0.5, 0.2, 0.1], [0.7, 0.1, 0.2]])
    every = np.arange(9)
    guessed = drive.guess(every, map_from_keyframe)
    drive.give_up(np.array([1, 2]), found, map_from_keyframe)
    assert drive.held_scans.tolist() == [4, 5, 7, 8]
    for each in (drive, Drive.from_arrays(drive.to_arrays())):
        again = each.guess(every, map_from_keyframe)
        assert again[1:3] == pytest.approx(found)
        assert np.array_equal(np.delete(again, [1, 2], axis=0), np.delete(guessed, [1, 2], axis=0))
        moved = np.array([3.0, -2.0, 1.0])
        there = each.guess(np.array([1, 2]), compose(moved, map_from_keyframe))
        assert there == pytest.approx(compose(moved, found))
