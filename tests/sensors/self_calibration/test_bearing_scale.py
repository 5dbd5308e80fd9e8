from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, wrap_angle
from racecar.sensors.scaled_bearings import with_bearings_scaled
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.bearing_scale import BearingScale, bearing_scale
from racecar.sensors.self_calibration.turn_agreement import TurnAgreement
from racecar.sensors.self_calibration.wall_straightness import WallStraightness, wall_straightness
from tests.sensors.drives import scans_of, winding_drive

SCANS = scans_of(winding_drive(6.0), 6.0)


@pytest.mark.parametrize("stated", [0.5, 0.75, 1.0])
def test_walls_show_the_angle_that_the_beams_lie_over(stated: float) -> None:
    scans = [replace(scan, bearings=scan.bearings * stated) for scan in SCANS]
    walls = wall_straightness(scans)
    assert walls is not None and walls.factor == pytest.approx(1.0 / stated, rel=0.04)


def round_room(radius: float) -> list[Scan]:
    """Off its middle by up to half of that."""
    bearings = np.linspace(-np.pi, np.pi, 240, endpoint=False)
    offsets = np.linspace(0.0, 0.5 * radius, 60)[:, None]
    ranges = np.sqrt(radius**2 - (offsets * np.sin(bearings)) ** 2) - offsets * np.cos(bearings)
    return [Scan(number, bearings, each, np.zeros(240), IDENTITY, 30.0) for number, each in enumerate(ranges)]


def test_a_round_room_is_no_fault() -> None:
    walls = wall_straightness(round_room(5.0))
    for ratios in ([], [TurnAgreement(0, 1.0, 0.01, 0.1)]):
        assert bearing_scale(walls, ratios, SCANS[0]) is None
    assert wall_straightness([]) is None


def scale(factor: float | None, *ratios: float) -> BearingScale | None:
    walls = None if factor is None else WallStraightness(factor)
    told = [TurnAgreement(0, ratio, 0.01, 0.1) for ratio in ratios]
    half_a_turn = replace(SCANS[0], bearings=0.5 * SCANS[0].bearings)
    return bearing_scale(walls, told, half_a_turn)


def assert_says(told: BearingScale | None, factor: float, *, is_certain: bool) -> None:
    assert told is not None and told.is_certain == is_certain
    assert told.factor == pytest.approx(factor, rel=0.01)


def test_walls_and_turns_together_are_certain() -> None:
    for ratios in ([0.48], [-0.51], [1.0, 0.49]):
        assert_says(scale(1.97, *ratios), 2.0, is_certain=True)
    assert_says(scale(1.65, 0.6), 1.65, is_certain=True)


def test_a_small_factor_needs_two_witnesses_besides_the_walls() -> None:
    assert_says(scale(0.84, 1.18, 1.2), 0.84, is_certain=True)
    for ratios in ([1.18], [1.18, 1.0], [1.2, 1.4], [1.05, 1.05]):
        assert scale(0.84, *ratios) is None
    assert scale(1.0, 1.18, 1.2) is None
    assert scale(0.95, 1.05, 1.05) is None


def test_walls_alone_or_turns_alone_are_not() -> None:
    assert_says(scale(1.97), 2.0, is_certain=False)
    assert_says(scale(1.97, 57.3), 2.0, is_certain=False)
    assert_says(scale(None, 0.5, 0.52), 1.96, is_certain=False)


@pytest.mark.parametrize(
    ("factor", "ratios"),
    [(1.0, [0.5]), (1.05, [1.0]), (2.0, [1.0]), (None, [0.5]), (None, [0.5, 1.0]), (None, [0.5, 2.0])],
)
def test_what_contradicts_itself_is_no_fault_of_the_angles(factor: float | None, ratios: list[float]) -> None:
    assert scale(factor, *ratios) is None


@pytest.mark.parametrize("turned", [0.0, 0.5, 3.0, -2.0])
def test_beams_told_over_half_a_turn_are_read_over_a_whole_one(turned: float) -> None:
    """Counted from wherever the first one looks."""
    first = turned - np.pi
    whole = np.asarray(wrap_angle(first + 2.0 * np.pi / 240 * np.arange(240)))
    half = np.asarray(wrap_angle(first + np.pi / 240 * np.arange(240)))
    ranges, offsets = np.arange(240.0), 0.001 * np.arange(240)

    def scan(bearings: NDArray[np.float64]) -> Scan:
        order = np.argsort(bearings)
        return Scan(0, bearings[order], ranges[order], offsets[order], IDENTITY, 300.0)

    read, right = with_bearings_scaled(scan(half), 2.0), scan(whole)
    assert np.cos(read.bearings - right.bearings) == pytest.approx(1.0)
    assert np.array_equal(read.ranges, right.ranges) and np.array_equal(read.time_offsets, right.time_offsets)


def test_beams_to_both_sides_stay_ahead() -> None:
    bearings = np.linspace(-0.5, 0.5, 101)
    read = with_bearings_scaled(Scan(0, bearings, bearings, 0.0 * bearings, IDENTITY, 30.0), 3.0)
    assert read.bearings == pytest.approx(3.0 * bearings) and np.array_equal(read.ranges, bearings)
