"""The whole mapper, on a car that drives round a room."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.schedule import calibrates_at
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose, inverse
from racecar.maps.grid.occupancy_grid import FREE_THRESHOLD
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import mapped, mean_error, missed, scans_of
from tests.sensors.drives import Drive, drive, room
from tests.sensors.worlds import CORRIDOR, scan_at


@cache
def driven() -> Drive:
    """A little more than one round."""
    return drive(room(), 13.0, np.random.default_rng(1))


def with_odometry(alter: Callable[[Odometry], Odometry]) -> Iterator[Scan | Odometry]:
    """The drive with each sample altered, in the order of time."""
    return (message if isinstance(message, Scan) else alter(message) for message in driven().messages)


def from_another_origin(odometry: Odometry) -> Odometry:
    """Another one every three seconds, as if its driver had been started anew."""
    starts = odometry.stamp // 3_000_000_000
    origin = np.array([4.0 * (starts % 3), -3.0 * (starts % 2), 1.3 * starts])
    return replace(odometry, odom_from_base=compose(origin, odometry.odom_from_base))


def test_maps_a_drive_and_repeats_to_the_bit() -> None:
    result = mapped(driven().messages)
    assert mean_error(result, driven().truth) < 0.1
    again = mapped(driven().messages)
    assert np.array_equal(result.trajectory.map_from_base, again.trajectory.map_from_base)
    assert np.array_equal(result.grid.cells, again.grid.cells)


def test_where_the_odometry_begins_anew_no_way_is_made_of_it() -> None:
    result = mapped(with_odometry(from_another_origin))
    assert mean_error(result, driven().truth) < 0.1


def test_without_odometry_the_map_is_right_all_the_same_and_says_so() -> None:
    result = mapped(scans_of(driven().messages))
    assert result.counts["odometry_constraints"] == 0
    assert "No wheel odometry" in result.warnings[0]
    assert mean_error(result, driven().truth) < 0.1


def test_without_a_scan_there_is_no_map() -> None:
    with pytest.raises(UserError, match="no usable scan"):
        Mapper(MappingConfig()).finish()


@pytest.mark.parametrize("goes_on_from_there", [True, False])
def test_odometry_that_hangs_for_some_seconds_is_left_out_there_and_told(goes_on_from_there: bool) -> None:
    """Then its poses go on from where they were, or from where the car is by now."""
    begin, end = 4_000_000_000, 7_000_000_000
    held, onward = np.zeros(3), np.zeros(3)

    def hang(sample: Odometry) -> Odometry:
        nonlocal held, onward
        pose = sample.odom_from_base
        if sample.stamp <= begin:
            held = pose
        elif sample.stamp < end:
            onward, pose = compose(held, inverse(pose)), held
        elif goes_on_from_there:
            pose = compose(onward, pose)
        return replace(sample, odom_from_base=pose)

    result = mapped(with_odometry(hang))
    assert mean_error(result, driven().truth) < 0.1
    assert "4.0 to 7.0 s" in str(result.warnings)
    steps = [c for c in result.constraints if c.kind == "odometry"]
    assert len(steps) < 0.9 * len(result.keyframe_indices)


def test_a_heading_that_hangs_for_some_seconds_is_left_out_there_and_told() -> None:
    held = 0.0

    def hang(sample: Odometry) -> Odometry:
        nonlocal held
        x, y, yaw = sample.odom_from_base.tolist()
        held = held if 4_000_000_000 < sample.stamp < 7_000_000_000 else yaw
        return replace(sample, odom_from_base=np.array([x, y, held]))

    result = mapped(with_odometry(hang))
    assert mean_error(result, driven().truth) < 0.05
    assert "4.0 to 7.0 s" in str(result.warnings)


def blinded(begin: float, end: float, reading: float) -> Iterator[Scan | Odometry]:
    """The drive with a laser that is covered for some seconds."""
    for message in driven().messages:
        if isinstance(message, Scan) and begin <= message.stamp * 1e-9 < end:
            yield replace(message, ranges=np.full(len(message.ranges), reading))
        else:
            yield message


def error_when_it_sees(result: MappingResult, begin: float, end: float) -> float:
    """Metres on average, of all scans but those between, seen from the first of them."""
    seconds = result.trajectory.stamps * 1e-9
    sees = (seconds < begin) | (seconds >= end)
    return float(missed(result.trajectory.map_from_base[sees], driven().truth[sees]).mean())


@pytest.mark.parametrize(("begin", "end", "reading"), [(5.0, 7.0, np.nan), (0.0, 6.0, np.inf)])
def test_wheels_carry_the_map_over_blank_scans(begin: float, end: float, reading: float) -> None:
    result = mapped(blinded(begin, end, reading))
    assert error_when_it_sees(result, begin, end) < 0.1
    assert len(result.trajectory) == len(driven().truth)


@pytest.mark.parametrize("begin", [0.0, 5.0])
def test_without_wheels_the_car_is_found_again_after_blank_scans(begin: float) -> None:
    """In that time it goes no farther than it is sought, if it goes on as before."""
    result = mapped(scans_of(blinded(begin, begin + 1.5, np.nan)))
    assert error_when_it_sees(result, begin, begin + 1.5) < 0.1


@pytest.mark.parametrize("odometry", [True, False])
def test_a_covered_laser_is_told_in_one_sentence(odometry: bool) -> None:
    with pytest.raises(UserError, match=r"Not one beam of \d+ scans met anything"):
        mapped(blinded(0.0, np.inf, np.nan) if odometry else scans_of(blinded(0.0, np.inf, np.nan)))


@pytest.mark.parametrize("standing", [4, 40])
def test_around_a_car_that_stands_there_is_free_space(standing: int) -> None:
    """One look leaves a cell at 40 percent; each scan of a car that stands is another."""
    first = scans_of(driven().messages)[0]
    result = mapped(
        replace(first, stamp=first.stamp + 50_000_000 * k, time_offsets=np.zeros(len(first.ranges)))
        for k in range(standing)
    )
    assert result.counts["keyframes"] == 1
    free = (result.grid.cells >= 0) & (result.grid.cells <= 100 * FREE_THRESHOLD)
    assert free.sum() * result.grid.resolution**2 > 20.0
    on_walls = result.grid.cells[tuple(result.grid.cell_of(result.session.points).T)] > 65
    assert on_walls.mean() > 0.98


def along_a_corridor(wheels_from: float) -> Iterator[Scan | Odometry]:
    """Straight on through a bare one at 0.2 m/s, in which no scan shows how far."""
    for tick in range(100):
        stamp, pose = 100_000_000 * tick, np.array([0.02 * tick, 0.0, 0.0])
        if stamp >= round(wheels_from * 1e9):
            yield Odometry(stamp, pose, np.zeros(3))
        yield scan_at(CORRIDOR, pose, stamp)


@pytest.mark.parametrize("wheels_from", [0.0, 0.3, 2.0])
def test_wheels_that_begin_after_the_first_scan_are_followed_from_there(wheels_from: float) -> None:
    result = mapped(along_a_corridor(wheels_from))
    way = result.trajectory.map_from_base[-1, 0] - result.trajectory.map_from_base[0, 0]
    assert way == pytest.approx(1.98 - 0.2 * wheels_from, abs=0.05)


def nearly_blind(scan: Scan, tick: int) -> Scan:
    """Of all returns twelve are left, which seem to turn."""
    ranges, shown = np.full_like(scan.ranges, np.inf), 5 + 3 * tick + np.arange(0, 24, 2)
    ranges[shown] = np.where(np.arange(12) < 6, 1.5, 2.0)
    return replace(scan, ranges=ranges)


def test_a_few_returns_refute_no_wheels() -> None:
    """A heading that is steered straight ahead does not look like one that hangs then."""
    messages = (
        nearly_blind(each, each.stamp // 100_000_000) if isinstance(each, Scan) else each
        for each in along_a_corridor(0.0)
    )
    result = mapped(messages)
    assert result.counts["odometry_constraints"] == len(result.keyframe_indices) - 1
    assert "repeated" not in str(result.warnings)


@pytest.mark.parametrize("stretch", [0.1, 1.0])
def test_wheels_are_calibrated_at_an_interval(stretch: float) -> None:
    assert [k for k in range(160) if calibrates_at(k, stretch)] == [0, 50, 100, 150]


def test_they_are_calibrated_as_often_per_metre_where_keyframes_lie_far_apart() -> None:
    assert [k for k in range(31) if calibrates_at(k, 6.6)] == [0, 8, 16, 24]


def test_they_are_calibrated_at_once_after_a_long_gap() -> None:
    assert all(calibrates_at(k, 100.0) for k in range(5))
