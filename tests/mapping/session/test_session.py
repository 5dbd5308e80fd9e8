"""A mapper that was put into arrays and back goes on to the same bits."""

from collections.abc import Sequence

import numpy as np
import pytest

from racecar.mapping import schedule
from racecar.mapping.arrays import Arrays
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.matching.scan_store import MAX_POINTS
from racecar.mapping.session.session import Session
from racecar.maps.sensing import turn_fusion
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.yaw_rate import YawRate
from tests.maps.drives import drive, pose_at, room


@pytest.fixture(scope="module")
def messages() -> list[Scan | Odometry]:
    """Of a car that drives round a room, with a laser of more beams than are kept of a scan."""
    bearings = np.linspace(-2.35, 2.35, 2 * MAX_POINTS)
    return drive(room(), 8.0, np.random.default_rng(2), bearings=bearings).messages


def with_yaw_rates(messages: list[Scan | Odometry]) -> list[Measurement]:
    """The same with a gyroscope that has a bias."""
    stamps = [message.stamp for message in messages if isinstance(message, Odometry)]
    headings = np.unwrap(pose_at(room(), np.array(stamps) * 1e-9, 1.5)[:, 2])
    rates = np.gradient(headings, np.array(stamps) * 1e-9) + 0.03
    samples = [YawRate(stamp, float(rate)) for stamp, rate in zip(stamps, rates, strict=True)]
    return sorted([*samples, *messages], key=lambda message: (message.stamp, isinstance(message, Scan)))


def feed(mapper: Mapper, messages: Sequence[Measurement], *, odometry: bool = True) -> None:
    for message in messages:
        if isinstance(message, Scan):
            mapper.add_scan(message)
        elif isinstance(message, YawRate):
            mapper.add_yaw_rate(message)
        elif odometry:
            mapper.add_odometry(message)


@pytest.mark.parametrize("odometry", [True, False])
@pytest.mark.parametrize("gyroscope", [True, False])
def test_goes_on_to_the_same_bits(
    messages: list[Scan | Odometry], odometry: bool, gyroscope: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, quickly in {"_SEGMENT_SECONDS": 0.2, "_TURN_UNTIL_TRIED": 0.5, "_KNOWN_SCALE": 0.3}.items():
        monkeypatch.setattr(turn_fusion, name, quickly)
    monkeypatch.setattr(schedule, "CHECKPOINT_INTERVAL", 10)
    messages = with_yaw_rates(messages) if gyroscope else messages
    whole, saved = Mapper(MappingConfig()), dict[int, Arrays]()
    for k, message in enumerate(messages):
        feed(whole, [message], odometry=odometry)
        if isinstance(message, Scan) and whole.can_be_saved:
            saved[k + 1] = {name: array.copy() for name, array in whole.to_arrays().items()}
    expected = whole.finish()
    assert whole.turn_model.is_believed == gyroscope
    assert len(saved) >= 2
    taken, arrays = list(saved.items())[1]
    assert all(array.dtype != object for array in arrays.values())
    resumed = Mapper.from_arrays(MappingConfig(), arrays)
    feed(resumed, messages[taken:], odometry=odometry)
    result = resumed.finish()
    assert np.array_equal(result.trajectory.map_from_base, expected.trajectory.map_from_base)
    assert np.array_equal(result.trajectory.stamps, expected.trajectory.stamps)
    assert np.array_equal(result.grid.cells, expected.grid.cells)
    assert result.counts == expected.counts


def test_a_snapshot_stays_as_it_was_while_the_mapper_goes_on(messages: list[Scan | Odometry]) -> None:
    mapper, half = Mapper(MappingConfig()), len(messages) // 2
    feed(mapper, messages[:half])
    expected = {name: array.copy() for name, array in mapper.to_arrays().items()}
    snapshot = mapper.snapshot()
    feed(mapper, messages[half:])
    assert len(mapper.to_arrays()["map_from_keyframe"]) > len(expected["map_from_keyframe"])
    taken = snapshot()
    assert taken.keys() == expected.keys()
    for name, array in expected.items():
        assert np.array_equal(taken[name], array, equal_nan=array.dtype.kind == "f"), name


def test_scans_between_keyframes_are_kept_thinned(messages: list[Scan | Odometry]) -> None:
    mapper = Mapper(MappingConfig())
    feed(mapper, messages[: len(messages) // 4])
    arrays = mapper.to_arrays()
    assert arrays["rays.returns"].astype(int).max() > MAX_POINTS
    assert arrays["drive.cloud_lengths"].astype(int).max() <= MAX_POINTS


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
