"""Each fault changes what it says, and nothing else."""

import numpy as np
import pytest

from benchmarks.harness import input_faults as faults
from benchmarks.quality.spoiled_maps import SPOILINGS, UNSPOILED
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

PERIOD = 100_000_000
BEARINGS = np.linspace(-2.0, 2.0, 41)
STEP = np.array([0.2, 0.0, 0.1])


def drive(scans: int = 100) -> list[Measurement]:
    """A scan each 0.1 s, of walls 2 to 6 m off, just after odometry that moves a step each."""
    place, messages = IDENTITY, list[Measurement]()
    for number in range(scans):
        ranges, offsets = np.linspace(2.0, 6.0, len(BEARINGS)), np.linspace(0.0, 0.05, len(BEARINGS))
        messages.append(Odometry(number * PERIOD, place, IDENTITY))
        messages.append(Scan(number * PERIOD + 1, BEARINGS, ranges, offsets, IDENTITY, 30.0))
        place = compose(place, STEP)
    return messages


def scans_of(messages: list[Measurement]) -> list[Scan]:
    return [message for message in messages if isinstance(message, Scan)]


def places_of(messages: list[Measurement]) -> np.ndarray:
    return np.array([message.odom_from_base for message in messages if isinstance(message, Odometry)])


def test_wheels_can_be_left_out_and_scaled() -> None:
    assert len(places_of(faults.without_wheels(drive()))) == 0
    same = places_of(faults.scaled_wheels(drive()))
    assert same == pytest.approx(places_of(drive()))
    changed = places_of(faults.scaled_wheels(drive(), forward=1.5, turn=0.5, bias=0.1))
    assert changed[1] == pytest.approx([0.3, 0.0, 0.05 + 0.1 * 0.2])
    assert changed[2] == pytest.approx(compose(changed[1], changed[1]))


def test_wheels_slip_now_and_then() -> None:
    slipped = places_of(faults.slipping_wheels(drive(400), every=4, spread=0.7))
    steps = np.hypot(*np.diff(slipped[:, :2], axis=0).T)
    assert 0.5 < np.mean(np.isclose(steps, 0.2)) < 0.95


@pytest.mark.parametrize("seconds", [0.35, -0.35])
def test_wheels_that_are_late_stay_in_the_order_of_time(seconds: float) -> None:
    messages = faults.late_wheels(drive(), seconds)
    stamps = [message.stamp for message in messages]
    assert stamps == sorted(stamps)
    first = next(message for message in messages if isinstance(message, Odometry))
    assert first.stamp == round(seconds * 1e9)


def test_scans_go_missing() -> None:
    assert len(scans_of(faults.sparse_scans(drive(), 1.0))) == 10
    assert len(places_of(faults.sparse_scans(drive(), 1.0))) == 100
    gaps = [scan.stamp * 1e-9 for scan in scans_of(faults.scan_gaps(drive(), 2.0, 5.0))]
    assert max(np.diff(gaps)) == pytest.approx(2.0, abs=0.11)
    dark = faults.blackout(drive(), 3.0)
    assert max(np.diff([message.stamp for message in dark])) == pytest.approx(3e9, abs=2e8)


def test_ranges_change() -> None:
    short = scans_of(faults.short_sighted(drive(), 4.0))[0]
    assert short.max_range == 4.0
    assert short.ranges[short.is_return].max() <= 4.0
    assert np.isinf(short.ranges).any()
    noise = np.array([scan.ranges for scan in scans_of(faults.noisy(drive(), 0.05))]) - drive()[1].ranges
    assert np.std(noise) == pytest.approx(0.05, rel=0.1)
    empty = np.array([scan.is_return for scan in scans_of(faults.dropping_out(drive(), 0.8))])
    assert np.mean(empty) == pytest.approx(0.2, abs=0.03)
    assert scans_of(faults.sees_floor(drive(), 3.0))[0].ranges[20] == pytest.approx(3.0)
    assert scans_of(faults.with_posts(drive()))[0].ranges.min() == 0.45


def test_beams_change() -> None:
    assert len(scans_of(faults.fewer_beams(drive(), 4))[0].bearings) == 11
    narrow = scans_of(faults.narrow(drive(), 90.0))[0]
    assert np.abs(narrow.bearings).max() < np.pi / 4
    assert len(narrow.ranges) == len(narrow.bearings) == len(narrow.time_offsets)
    assert scans_of(faults.reversed_sweep(drive()))[0].time_offsets[0] == pytest.approx(0.05)
    assert scans_of(faults.scaled_bearings(drive(), 0.5))[0].bearings[0] == pytest.approx(-1.0)
    moved = np.array([0.5, 0.2, 0.1])
    assert scans_of(faults.moved_mount(drive(), moved))[0].base_from_laser == pytest.approx(moved)


@pytest.mark.parametrize("name", SPOILINGS)
def test_every_way_to_spoil_a_drive_changes_it_or_the_settings(name: str) -> None:
    how, before = SPOILINGS[name], drive(200)
    after = how.spoiled(before)
    is_same = len(before) == len(after) and all(a is b for a, b in zip(before, after, strict=True))
    assert (is_same and not how.settings and not how.replacements) == (name == UNSPOILED)
    MappingConfig.model_validate(how.settings)
    with how.in_place():
        assert all(getattr(owner, thing) == by for owner, thing, by in how.replacements)
