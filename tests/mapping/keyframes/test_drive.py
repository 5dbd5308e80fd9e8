import numpy as np
import pytest

from racecar.mapping.keyframes import drive as drive_module
from racecar.mapping.keyframes.drive import Drive
from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.sensors.motion.motion_guesses import AT_KEYFRAME, GuessSource, MotionGuesses

WHEELS, SCANS, STEADY = GuessSource
MOTIONS = {source: np.array([metres, 0.0, 0.0]) for metres, source in enumerate(GuessSource, start=1)}
ALL, WITHOUT_WHEELS = MotionGuesses(MOTIONS), MotionGuesses({each: MOTIONS[each] for each in (SCANS, STEADY)})
NO_POINTS = np.zeros((0, 2))


def drive_with(guesses: MotionGuesses, at_keyframe: MotionGuesses, right: GuessSource) -> np.ndarray:
    """Where a scan between two keyframes is guessed to be; both are at the same place, as odometry says."""
    drive = Drive()
    drive.start_keyframe(AT_KEYFRAME, STEADY)
    drive.add(0, NO_POINTS, AT_KEYFRAME)
    drive.add(1, NO_POINTS, guesses)
    drive.start_keyframe(at_keyframe, right)
    drive.add(2, NO_POINTS, AT_KEYFRAME)
    return drive.guess(np.array([1]), np.array([IDENTITY, at_keyframe.by[right]]))[0]


def test_scans_between_keyframes_lie_where_the_guess_that_was_right_puts_them() -> None:
    for right in GuessSource:
        assert np.array_equal(drive_with(ALL, ALL, right), MOTIONS[right])


def test_a_scan_of_which_wheels_say_nothing_goes_by_the_same_source_as_its_neighbours() -> None:
    assert np.array_equal(drive_with(WITHOUT_WHEELS, ALL, SCANS), MOTIONS[SCANS])
    assert np.array_equal(drive_with(WITHOUT_WHEELS, ALL, STEADY), MOTIONS[STEADY])
    assert np.array_equal(drive_with(WITHOUT_WHEELS, ALL, WHEELS), MOTIONS[SCANS])


def test_a_scan_that_wheels_saw_goes_by_scans_where_they_say_nothing_of_the_keyframe() -> None:
    assert np.array_equal(drive_with(ALL, WITHOUT_WHEELS, SCANS), MOTIONS[SCANS])


def test_the_returns_of_scans_between_keyframes_are_kept() -> None:
    drive = Drive()
    for index in range(6):
        if index in (0, 3):
            drive.start_keyframe(AT_KEYFRAME, STEADY)
        drive.add(index, np.full((2, 2), float(index)), AT_KEYFRAME)
    assert drive.kept_scans.tolist() == [1, 2, 4, 5]
    assert [drive.clouds[scan][:, 0].tolist() for scan in drive.kept_scans] == [[k, k] for k in (1, 2, 4, 5)]
    assert drive.keyframe_of(np.arange(6)).tolist() == [0, 0, 0, 1, 1, 1]


def test_of_a_car_that_stands_not_all_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drive_module, "SCANS_PER_KEYFRAME", 3)
    drive = Drive()
    drive.start_keyframe(AT_KEYFRAME, STEADY)
    for index in range(8):
        drive.add(index, np.ones((2, 2)), AT_KEYFRAME)
    assert drive.kept_scans.tolist() == [1, 2, 3]
    assert len(drive) == 8


def test_scans_that_were_trimmed_stay_where_they_were_found() -> None:
    drive, step = Drive(), np.array([1.0, 0.0, 0.0])
    for index in range(9):
        if index % 3 == 0:
            drive.start_keyframe(MotionGuesses({SCANS: step}), SCANS)
        drive.add(index, np.ones((2, 2)), MotionGuesses({SCANS: (index % 3) / 3 * step}))
    map_from_keyframe = np.array([[0.0, 0.0, 0.0], [1.1, 0.1, 0.3], [2.0, 0.5, 0.4]])
    found = np.array([[0.5, 0.2, 0.1], [0.7, 0.1, 0.2]])
    every = np.arange(9)
    guessed = drive.guess(every, map_from_keyframe)
    drive.trim(np.array([1, 2]), found, map_from_keyframe)
    assert drive.kept_scans.tolist() == [4, 5, 7, 8]
    again = drive.guess(every, map_from_keyframe)
    assert again[1:3] == pytest.approx(found)
    assert np.array_equal(np.delete(again, [1, 2], axis=0), np.delete(guessed, [1, 2], axis=0))
    moved = np.array([3.0, -2.0, 1.0])
    there = drive.guess(np.array([1, 2]), compose(moved, map_from_keyframe))
    assert there == pytest.approx(compose(moved, found))
