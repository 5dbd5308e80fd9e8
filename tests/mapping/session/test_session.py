"""What a mapper knows, and the session that is left of it, come back as they were."""

import pickle
from collections.abc import Sequence

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.sensors.matching.scan_store import MAX_POINTS
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import drive, room


@pytest.fixture(scope="module")
def messages() -> list[Scan | Odometry]:
    """Of a car that drives round a room, with a laser of more beams than are kept of a scan."""
    bearings = np.linspace(-2.35, 2.35, 2 * MAX_POINTS)
    return drive(room(), 8.0, np.random.default_rng(2), bearings=bearings).messages


def feed(mapper: Mapper, messages: Sequence[Scan | Odometry], *, odometry: bool = True) -> None:
    for message in messages:
        if isinstance(message, Scan):
            mapper.add_scan(message)
        elif odometry:
            mapper.add_odometry(message)


@pytest.mark.parametrize("odometry", [True, False])
def test_a_pickled_mapper_finishes_as_the_other_does(messages: list[Scan | Odometry], odometry: bool) -> None:
    mapper = Mapper(MappingConfig())
    feed(mapper, messages, odometry=odometry)
    taken = pickle.dumps(mapper)
    expected, result = mapper.finish(), pickle.loads(taken).finish()
    assert np.array_equal(result.trajectory.map_from_base, expected.trajectory.map_from_base)
    assert np.array_equal(result.trajectory.stamps, expected.trajectory.stamps)
    assert np.array_equal(result.grid.cells, expected.grid.cells)
    assert result.counts == expected.counts


def test_scans_between_keyframes_are_kept_thinned(messages: list[Scan | Odometry]) -> None:
    mapper = Mapper(MappingConfig())
    feed(mapper, messages[: len(messages) // 4])
    assert max(rays.returns for rays in mapper.session().rays) > MAX_POINTS
    assert max(map(len, mapper._state.drive.clouds.values())) <= MAX_POINTS


@pytest.mark.parametrize("close_loops", [True, False])
def test_a_session_reads_back_as_it_was(messages: list[Scan | Odometry], close_loops: bool) -> None:
    mapper = Mapper(MappingConfig(close_loops=close_loops))
    feed(mapper, messages)
    session = mapper.finish().session
    assert session.loops.submaps
    arrays = session.to_arrays()
    again = Session.from_arrays(arrays).to_arrays()
    assert arrays.keys() == again.keys()
    for name, array in arrays.items():
        assert array.dtype == again[name].dtype, name
        assert np.array_equal(array, again[name]), name
