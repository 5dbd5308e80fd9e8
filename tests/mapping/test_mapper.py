"""The whole mapper, on a car that drives round a room."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from tests.mapping.mapping_errors import mean_error
from tests.maps.drives import Drive, drive, room


@cache
def driven() -> Drive:
    """A little more than one round."""
    return drive(room(), 13.0, np.random.default_rng(1))


def mapped(*, odometry: bool = True, resets: bool = False) -> MappingResult:
    mapper = Mapper(MappingConfig())
    for message in driven().messages:
        if isinstance(message, Scan):
            mapper.add_scan(message)
        elif odometry:
            mapper.add_odometry(from_another_origin(message) if resets else message)
    return mapper.finish()


def from_another_origin(odometry: Odometry) -> Odometry:
    """Another one every three seconds, as if its driver had been started anew."""
    starts = odometry.stamp // 3_000_000_000
    origin = np.array([4.0 * (starts % 3), -3.0 * (starts % 2), 1.3 * starts])
    return replace(odometry, odom_from_base=compose(origin, odometry.odom_from_base))


def test_maps_a_drive_and_repeats_to_the_bit() -> None:
    result = mapped()
    assert mean_error(result, driven().truth) < 0.1
    again = mapped()
    assert np.array_equal(result.trajectory.map_from_base, again.trajectory.map_from_base)
    assert np.array_equal(result.grid.cells, again.grid.cells)


def test_where_the_odometry_begins_anew_no_way_is_made_of_it() -> None:
    result = mapped(resets=True)
    assert mean_error(result, driven().truth) < 0.1


def test_runs_without_odometry_and_says_so() -> None:
    result = mapped(odometry=False)
    assert result.counts["odometry_constraints"] == 0
    assert "no wheel odometry" in result.warnings[0]


def test_without_odometry_the_map_is_right_all_the_same() -> None:
    assert mean_error(mapped(odometry=False), driven().truth) < 0.1


def test_without_a_scan_there_is_no_map() -> None:
    with pytest.raises(UserError, match="no usable scan"):
        Mapper(MappingConfig()).finish()
