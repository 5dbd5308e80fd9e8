import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.sensors.corrections import NO_CORRECTIONS, Corrections, Corrector
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

BEARINGS, OFFSETS = np.array([-1.0, 0.0, 2.0]), np.array([0.0, 0.1, 0.3])
PLACE = np.array([0.1, 0.0, np.pi])


def scan(stamp: int = 5) -> Scan:
    return Scan(stamp, BEARINGS, np.array([1.0, np.inf, 3.0]), OFFSETS, IDENTITY, 9.0)


def test_without_corrections_nothing_is_touched() -> None:
    corrector, sweep, sample = Corrector(NO_CORRECTIONS), scan(), Odometry(3, np.ones(3), np.ones(3))
    assert corrector.correct(sweep) is sweep
    assert corrector.correct(sample) is sample
    assert NO_CORRECTIONS.inputs == {}


def test_reversed_beams() -> None:
    corrected = Corrector(Corrections(beams_are_reversed=True)).scan(scan())
    assert corrected.time_offsets.tolist() == pytest.approx([0.3, 0.2, 0.0])
    assert corrected.bearings.tolist() == BEARINGS.tolist()
    assert corrected.ranges.tolist() == [1.0, np.inf, 3.0]


def test_a_laser_upside_down() -> None:
    corrected = Corrector(Corrections(is_upside_down=True, base_from_laser=PLACE)).scan(scan())
    assert corrected.bearings.tolist() == [-2.0, 0.0, 1.0]
    assert corrected.ranges.tolist() == [3.0, np.inf, 1.0]
    assert corrected.time_offsets.tolist() == [0.3, 0.1, 0.0]
    assert corrected.base_from_laser is PLACE


def test_both_at_once_are_those_of_one_after_the_other() -> None:
    both = Corrector(Corrections(is_upside_down=True, beams_are_reversed=True)).scan(scan())
    first = Corrector(Corrections(beams_are_reversed=True)).scan(scan())
    then = Corrector(Corrections(is_upside_down=True)).scan(first)
    assert both.time_offsets.tolist() == then.time_offsets.tolist()
    assert both.bearings.tolist() == then.bearings.tolist()


def test_what_scans_share_is_shared_on_and_may_change() -> None:
    corrector = Corrector(Corrections(beams_are_reversed=True))
    first, second = corrector.scan(scan(1)), corrector.scan(scan(2))
    assert first.time_offsets is second.time_offsets and not first.time_offsets.flags.writeable
    longer = Scan(3, np.append(BEARINGS, 2.5), np.ones(4), np.append(OFFSETS, 0.5), IDENTITY, 9.0)
    assert corrector.scan(longer).time_offsets.tolist() == pytest.approx([0.5, 0.4, 0.2, 0.0])


def test_clocks_and_signs() -> None:
    corrections = Corrections(scan_shift=7, odometry_shift=-2, odometry_factors=(1.0, -1.0, -1.0))
    corrector = Corrector(corrections)
    assert corrector.scan(scan()).stamp == 12
    sample = corrector.odometry(Odometry(3, np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.2, 0.3])))
    assert sample.stamp == 1
    assert sample.odom_from_base.tolist() == [1.0, -2.0, -0.5]
    assert sample.twist.tolist() == [0.1, -0.2, -0.3]
    assert set(corrections.inputs["corrections"]) == {"scan_shift_s", "odometry_shift_s", "odometry_factors"}  # type: ignore[call-overload]


def test_a_place_with_a_roll_is_that_of_a_laser_upside_down() -> None:
    place = SensorPlace.from_pose(np.array([0.2, -0.1, 1.0, np.pi]), "given")
    assert place.is_upside_down and place.tilt == pytest.approx(0.0, abs=1e-6)
    assert place.pose == pytest.approx([0.2, -0.1, 1.0])
    upright = SensorPlace.from_pose(np.array([0.2, -0.1, 1.0]), "given")
    assert not upright.is_upside_down and upright.pose == pytest.approx([0.2, -0.1, 1.0])
    assert SensorPlace.from_pose(np.array([0.0, 0.0, 0.0, 0.4]), "given").tilt == pytest.approx(0.4)


def test_reversed_beams_before_their_stamp_have_a_time_increment_of_the_wrong_sign() -> None:
    sweep = Scan(5, BEARINGS, np.array([1.0, 2.0, 3.0]), -OFFSETS, IDENTITY, 9.0)
    corrected = Corrector(Corrections(beams_are_reversed=True)).scan(sweep)
    assert corrected.time_offsets.tolist() == OFFSETS.tolist()
