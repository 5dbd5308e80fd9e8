"""Lasers that look front and rear: each scan has the place of the one that took it."""

from dataclasses import replace

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.sensors.motion.mounts import Mounts
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import errors, missed
from tests.sensors.worlds import BEARINGS, ROOM, scan_at

FRONT, REAR = np.array([0.3, 0.0, 0.0]), np.array([-0.3, 0.1, np.pi])
HALF = np.flatnonzero(np.abs(BEARINGS) <= np.pi / 2)
PERIOD = 100_000_000
TURN = np.linspace(0.0, 2 * np.pi, 80)
CIRCLE = np.column_stack([1.5 * np.sin(TURN), 1.5 - 1.5 * np.cos(TURN), TURN]) + np.array([-0.5, -1.0, 0.0])
"""(80, 3) of the base, through all the room."""


def half_scan(map_from_base: Pose, stamp: int, laser: int) -> Scan:
    place = (FRONT, REAR)[laser]
    scan = scan_at(ROOM, compose(map_from_base, place), stamp, place)
    bearings, ranges, offsets = (each[HALF] for each in (scan.bearings, scan.ranges, scan.time_offsets))
    return replace(scan, bearings=bearings, ranges=ranges, time_offsets=offsets, laser=laser)


def drive(mapper: Mapper, lasers: list[list[int]], *, has_wheels: bool = True) -> Pose:
    """The lasers that scan at each stop, in turn; what the mapper answers."""
    answers = []
    for number, map_from_base in enumerate(CIRCLE):
        if has_wheels:
            odom_from_base = compose(np.array([3.0, 1.0, -2.0]), map_from_base)
            mapper.add_odometry(Odometry(number * PERIOD, odom_from_base, IDENTITY))
        for laser in lasers[number % len(lasers)]:
            answers.append(mapper.add_scan(half_scan(map_from_base, number * PERIOD + laser, laser)))
    return np.array(answers)


@pytest.mark.parametrize("lasers", [[[0], [1]], [[0, 1]], [[0], [0], [0], [1], [1]], [[1], [0]]])
def test_a_map_of_both(lasers: list[list[int]]) -> None:
    mapper = Mapper(MappingConfig())
    answers = drive(mapper, lasers)
    result = mapper.finish()
    truth = np.repeat(CIRCLE, [len(lasers[number % len(lasers)]) for number in range(len(CIRCLE))], axis=0)
    assert errors(result, truth).max() < 0.01
    assert missed(answers, truth).max() < 0.03
    places = inverse(result.session.keyframe_from_base)
    assert {tuple(np.round(place, 3)) for place in places} == {
        tuple(np.round(place, 3)) for place in (FRONT, REAR)
    }


def test_what_only_the_rear_one_sees_is_on_the_map() -> None:
    """The car drives straight on; behind it is a wall."""

    def walls(lasers: list[list[int]]) -> int:
        mapper = Mapper(MappingConfig())
        for number in range(20):
            map_from_base = np.array([-1.0 + 0.1 * number, 0.0, 0.0])
            mapper.add_odometry(Odometry(number * PERIOD, map_from_base, IDENTITY))
            for laser in lasers[number % len(lasers)]:
                mapper.add_scan(half_scan(map_from_base, number * PERIOD, laser))
        grid = mapper.finish().grid
        cells = grid.center_of(np.argwhere(grid.cells >= 65))
        return int((np.abs(cells[:, 0] - (-4.0 + 1.0)) < 0.1).sum())

    assert walls([[0]]) == 0
    assert walls([[0], [1]]) > 20


def test_without_wheels_the_first_laser_makes_the_map() -> None:
    """Nothing else tells the motion between scans that see different places."""
    mapper = Mapper(MappingConfig())
    drive(mapper, [[0, 1]], has_wheels=False)
    result = mapper.finish()
    assert len(result.trajectory.stamps) == len(CIRCLE)
    assert errors(result, CIRCLE).max() < 0.02
    (told,) = [each for each in result.warnings if "80 scans of further lasers were left out" in each]
    assert "Record odometry" in told


def test_mounts_by_laser() -> None:
    mounts = Mounts()
    assert not mounts.is_further(1)
    assert mounts.take(half_scan(IDENTITY, 0, 1)) is not None
    assert mounts.are_one
    assert mounts.of(1) is None
    assert mounts.take(half_scan(IDENTITY, 0, 0)) is None
    np.testing.assert_allclose(compose(REAR, mounts.of(0)), FRONT, atol=1e-12)
    poses = np.array([[1.0, 2.0, 0.5], [1.0, 2.0, 0.5]])
    moved = mounts.to_laser(poses, [1, 0])
    np.testing.assert_allclose(moved[0], poses[0])
    np.testing.assert_allclose(mounts.to_reference(moved, [1, 0]), poses, atol=1e-12)
    np.testing.assert_array_equal(mounts.base_from_reference, REAR)
    np.testing.assert_array_equal(mounts.laser_from_base([0, 1]), inverse(np.array([FRONT, REAR])))
    late = replace(half_scan(IDENTITY, 0, 1), base_from_laser=FRONT)
    np.testing.assert_allclose(mounts.take(late), between(REAR, FRONT))
