"""Numbers in LaserScan messages that cannot be meant as they stand."""

from collections import Counter

import numpy as np
import pytest

from racecar.pipelines.bags.converters.laser_scans import LaserScanConverter
from racecar.pipelines.bags.converters.scan_reading import (
    AS_STATED,
    Angles,
    ScanReading,
    ScanSetup,
    learn_reading,
    read_from_the_other_end,
)
from tests.pipelines.bags.converters.test_laser_scans import UPRIGHT, message

BEAMS = 271
SPAN = np.radians(270.0)
STATED = {"angle_min": -SPAN / 2, "angle_max": SPAN / 2, "angle_increment": SPAN / (BEAMS - 1)}


def room_ranges(x, y, yaw, beams=BEAMS, span=SPAN):
    """What a laser sees of a room of 8 m by 6 m, to a centimetre."""
    bearings = yaw + np.linspace(-span / 2, span / 2, beams)
    cos, sin = np.cos(bearings), np.sin(bearings)
    along = np.where(cos > 0, 4.0 - x, 4.0 + x) / np.maximum(np.abs(cos), 1e-9)
    across = np.where(sin > 0, 3.0 - y, 3.0 + y) / np.maximum(np.abs(sin), 1e-9)
    return np.minimum(along, across) + np.random.default_rng(int(1e6 * abs(x))).normal(0.0, 0.01, beams)


def drive(change=lambda ranges: ranges, scans=40, **changes):
    """Messages of a laser that goes through the room and turns."""
    return [
        message(change(room_ranges(0.1 * k - 2.0, 0.3, 0.05 * k)), **{**STATED, "range_max": 30.0, **changes})
        for k in range(scans)
    ]


def bearings_of(messages):
    reading, findings = learn_reading(messages)
    scan = LaserScanConverter(ScanSetup(UPRIGHT, 1.0, reading=reading), Counter()).convert(messages[0], 0)
    return scan.bearings, reading, findings


def test_what_is_right_is_read_as_it_stands():
    assert learn_reading(drive()) == (AS_STATED, [])


@pytest.mark.parametrize(
    ("changes", "angles"),
    [
        ({name: float(np.degrees(value)) for name, value in STATED.items()}, Angles.DEGREES),
        ({"angle_increment": float(np.degrees(STATED["angle_increment"]))}, Angles.SPREAD),
        ({"angle_increment": STATED["angle_increment"] / 2}, Angles.SPREAD),
        ({"angle_increment": STATED["angle_increment"] * 1.3}, Angles.SPREAD),
        ({"angle_max": 0.0}, Angles.STATED),
        ({"angle_max": STATED["angle_max"] * 0.7}, Angles.STATED),
    ],
)
def test_contradicting_angles_are_read_so_that_walls_are_straight(changes, angles):
    bearings, reading, (finding,) = bearings_of(drive(**changes))
    assert reading.angles == angles
    np.testing.assert_allclose(bearings, np.linspace(-SPAN / 2, SPAN / 2, BEAMS), atol=1e-6)
    assert (finding.name, finding.spoils_map) == ("angles_not_as_stated", False)


def test_angles_of_two_turns_are_those_of_one():
    doubled = {"angle_min": -np.pi, "angle_max": 3 * np.pi, "angle_increment": 4 * np.pi / BEAMS}
    _, reading, (finding,) = bearings_of(drive(**doubled))
    assert reading.angles == Angles.TURN
    assert finding.numbers["is_beyond_a_turn"]


def test_a_turned_increment_keeps_its_sign():
    """From left to right, and the increment of another number of beams."""
    messages = drive(
        lambda ranges: ranges[::-1],
        angle_min=SPAN / 2,
        angle_max=-SPAN / 2,
        angle_increment=-STATED["angle_increment"] / 2,
    )
    bearings, reading, _ = bearings_of(messages)
    assert reading.angles == Angles.SPREAD
    np.testing.assert_allclose(bearings, np.linspace(-SPAN / 2, SPAN / 2, BEAMS), atol=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("turned", [0.0, np.radians(45.0)])
def test_where_only_the_signs_contradict_each_other_the_beams_begin_at_angle_max(side, turned):
    messages = drive(
        lambda ranges: ranges[:: -int(side)],
        angle_min=turned - side * SPAN / 2,
        angle_max=turned + side * SPAN / 2,
        angle_increment=-side * STATED["angle_increment"],
    )
    bearings, reading, (finding,) = bearings_of(messages)
    assert (reading.angles, finding.spoils_map) == (Angles.FROM_LAST, False)
    np.testing.assert_allclose(np.sort(bearings), turned + np.linspace(-SPAN / 2, SPAN / 2, BEAMS), atol=1e-6)
    other, told = read_from_the_other_end(reading, finding)
    first, step = other.angles.first_and_increment(messages[0].angle_min, messages[0].angle_max, 0.0, BEAMS)
    assert (first, np.sign(step)) == (messages[0].angle_min, side)
    assert "as the turns show" in told.what


def test_where_scans_do_not_decide_a_map_may_be_wrong():
    clutter = np.random.default_rng(0)
    messages = drive(
        lambda ranges: clutter.uniform(1.0, 2.5, BEAMS), angle_increment=0.5 * STATED["angle_increment"]
    )
    _, reading, (finding,) = bearings_of(messages)
    assert reading.angles == Angles.STATED
    assert finding.spoils_map


def test_drivers_that_are_off_by_a_beam_are_not_talked_about():
    for beams_off in (-1, 1, 2):
        angle_max = STATED["angle_max"] + beams_off * STATED["angle_increment"]
        assert learn_reading(drive(angle_max=angle_max)) == (AS_STATED, [])


def test_misses_written_as_a_number_below_range_max():
    """Beyond a door to each side there is nothing in reach."""

    def with_misses(ranges):
        return np.where(ranges > 3.6, 12.0, ranges)

    messages = drive(with_misses)
    reading, (finding,) = learn_reading(messages)
    assert reading == ScanReading(nearest_miss=12.0)
    assert (finding.name, finding.numbers["metres"]) == ("misses_as_a_range", 12.0)
    scan = LaserScanConverter(ScanSetup(UPRIGHT, 1.0, reading=reading), Counter()).convert(messages[0], 0)
    assert scan.max_range == 12.0
    np.testing.assert_array_equal(np.isposinf(scan.ranges), messages[0].ranges == 12.0)
    assert np.isposinf(scan.ranges).any()


@pytest.mark.parametrize("step", [0.001, 0.01, 0.05])
def test_a_wall_is_no_miss_however_coarse_the_ranges_are(step):
    """Of a car that stands before the only wall in reach, and of one that drives along it."""
    rng = np.random.default_rng(1)
    for speed in (0.0, 0.1):
        messages = []
        for k in range(40):
            bearings = np.linspace(-SPAN / 2, SPAN / 2, BEAMS)
            wall = (8.0 - speed * k) / np.maximum(np.cos(bearings), 1e-9)
            ranges = np.where(np.abs(bearings) < 0.3, wall + rng.normal(0.0, 0.01, BEAMS), np.inf)
            messages.append(message(np.round(ranges / step) * step, **STATED, range_max=30.0))
        assert learn_reading(messages) == (AS_STATED, [])


@pytest.mark.parametrize(
    ("factor", "per_metre", "unit"),
    [
        (1000.0, 1000.0, "millimetres"),
        (100.0, 100.0, "centimetres"),
        (40.0, 100.0, "centimetres"),  # of a room so small that they might be metres
    ],
)
@pytest.mark.parametrize("are_limits_in_metres", [True, False])
def test_ranges_in_another_unit(factor, per_metre, unit, are_limits_in_metres):
    limits = 1.0 if are_limits_in_metres else per_metre
    messages = drive(lambda ranges: factor * ranges, range_min=0.1 * limits, range_max=30.0 * limits)
    reading, (finding,) = learn_reading(messages)
    assert finding.numbers["unit"] == unit and not finding.spoils_map
    scan = LaserScanConverter(ScanSetup(UPRIGHT, 1.0, reading=reading), Counter()).convert(messages[0], 0)
    np.testing.assert_allclose(scan.ranges, messages[0].ranges / per_metre, rtol=1e-6)
    assert scan.max_range == pytest.approx(30.0)


@pytest.mark.parametrize("shrinkage", [1.0, 0.3])
def test_a_small_room_in_millimetres_is_no_large_one_in_centimetres(shrinkage):
    messages = drive(
        lambda ranges: 1000.0 * (shrinkage * ranges + np.random.default_rng(0).normal(0.0, 0.01, BEAMS)),
        range_max=30_000.0,
    )
    assert learn_reading(messages)[0].unit == 1e-3


@pytest.mark.parametrize("range_max", [30.0, 5000.0, np.inf])
def test_misses_beyond_the_range_are_no_centimetres(range_max):
    messages = drive(lambda ranges: np.where(ranges > 3.2, 65.533, ranges), range_max=range_max)
    assert learn_reading(messages)[0].unit == 1.0


def test_beams_of_a_sensor_that_turns_unevenly_span_the_same():
    """More and fewer of them than the increment that is stated leads to."""
    rng = np.random.default_rng(3)
    messages = [
        message(room_ranges(0.1 * k - 2.0, 0.3, 0.05 * k, beams=int(count)), **STATED, range_max=30.0)
        for k, count in enumerate(rng.integers(BEAMS - 15, BEAMS + 15, 40))
    ]
    bearings, reading, (finding,) = bearings_of(messages)
    assert reading.angles == Angles.SPREAD and not finding.spoils_map
    np.testing.assert_allclose(bearings, np.linspace(-SPAN / 2, SPAN / 2, len(bearings)), atol=1e-6)


def test_scans_that_lost_their_last_beams_are_read_as_stated():
    messages = drive()
    for each in messages[::3]:
        each.ranges = each.ranges[:-40]
    assert learn_reading(messages) == (AS_STATED, [])


def test_ranges_of_no_unit_spoil_the_map():
    messages = drive(lambda ranges: 1e6 * ranges, range_max=3e38)
    reading, (finding,) = learn_reading(messages)
    assert (reading, finding.spoils_map) == (AS_STATED, True)
    counts = Counter()
    scan = LaserScanConverter(ScanSetup(UPRIGHT, 1.0, reading=reading), counts).convert(messages[0], 0)
    assert np.isposinf(scan.ranges).all()
    assert counts["scans_without_range_max"] == 1


def test_numbers_that_are_none():
    nothing = np.full(BEAMS, np.nan)
    for changes in ({}, {"angle_min": np.nan}, {"angle_max": np.inf}, {"angle_increment": 0.0}):
        learn_reading(drive(lambda ranges: nothing, **changes))
    assert learn_reading([]) == (AS_STATED, [])
    assert learn_reading([message([])]) == (AS_STATED, [])
