"""What a mapper knows and the session that is left of it come back as they were; what is none is refused."""

import pickle
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.sensors.arrays import Arrays
from racecar.sensors.matching.scan_store import MAX_POINTS
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import feed, mapped, scans_of
from tests.sensors.drives import drive, room


@pytest.fixture(scope="module")
def messages() -> list[Scan | Odometry]:
    """Of a car that drives round a room, with a laser of more beams than are kept of a scan."""
    bearings = np.linspace(-2.35, 2.35, 2 * MAX_POINTS)
    return drive(room(), 8.0, np.random.default_rng(2), bearings=bearings).messages


@pytest.mark.parametrize("odometry", [True, False])
def test_a_pickled_mapper_finishes_as_the_other_does(messages: list[Scan | Odometry], odometry: bool) -> None:
    mapper = Mapper(MappingConfig())
    feed(mapper, messages if odometry else scans_of(messages))
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


Change = Callable[[NDArray[np.generic]], object]


@pytest.fixture(scope="module")
def arrays() -> Arrays:
    return mapped(drive(room(), 12.0, np.random.default_rng(3)).messages).session.to_arrays()


def test_a_session_is_one(arrays: Arrays) -> None:
    assert len(arrays["loops.submaps"]) > 0
    assert Session.from_arrays(arrays).to_arrays().keys() == arrays.keys()


def _set(value: float) -> Change:
    def change(array: NDArray[np.generic]) -> object:
        changed = array.copy()
        changed.reshape(-1)[len(changed) // 2] = value
        return changed

    return change


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("map_from_keyframe", lambda array: array[:-1]),
        ("map_from_keyframe", lambda array: array.T),
        ("map_from_keyframe", lambda array: array.astype(np.complex128)),
        ("map_from_keyframe", _set(np.nan)),
        ("keyframe_from_base", lambda array: np.float64(3.0)),
        ("keyframe_from_base", _set(1e300)),
        ("times.stamps", lambda array: array[:-1]),
        ("times.recordings", _set(1)),
        ("times.spans", lambda array: array.ravel()),
        ("scans.counts", _set(-1)),
        ("scans.counts", _set(20_000)),
        ("scans.counts", lambda array: array.astype(np.float64)),
        ("scans.points", _set(np.inf)),
        ("scans.points", lambda array: array[1:]),
        ("scans.normals", _set(np.nan)),
        ("rays.lengths", _set(2**31 - 1)),
        ("rays.returns", _set(10_000)),
        ("rays.ends", _set(1e9)),
        ("rays.ends", lambda array: np.zeros(0)),
        ("constraints.keyframes", _set(100_000)),
        ("constraints.keyframes", _set(-1)),
        ("constraints.kinds", _set(4)),
        ("constraints.kinds", lambda array: array[:1]),
        ("constraints.poses", lambda array: array.astype("U5")),
        ("constraints.information", _set(np.inf)),
        ("loops.submaps", _set(100_000)),
        ("loops.edges", lambda array: np.array([[0.5, 0.0, 1.0]])),
        ("loops.hypothesis_submaps", lambda array: np.array([[0, 10_000]], dtype=np.int32)),
        ("loops.log_counts", lambda array: np.append(array, 1)),
    ],
)
def test_an_array_that_cannot_be_is_named(arrays: Arrays, name: str, change: Change) -> None:
    with pytest.raises(ValueError, match=name.split(".")[0]):
        Session.from_arrays({**arrays, name: np.asarray(change(arrays[name]))})


def test_each_array_is_needed(arrays: Arrays) -> None:
    for name in arrays:
        with pytest.raises(ValueError, match=f"{name} is missing"):
            Session.from_arrays({other: array for other, array in arrays.items() if other != name})


def test_a_session_of_nothing(arrays: Arrays) -> None:
    empty = {name: array[:0] for name, array in arrays.items()}
    with pytest.raises(ValueError, match="map_from_keyframe is empty"):
        Session.from_arrays(empty)
