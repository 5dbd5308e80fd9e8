"""A laser is followed by its scans and its velocity alone, also where scans constrain it little."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.matching.scan_store import prepare_scan
from racecar.sensors.motion.deskew import by_velocity
from racecar.sensors.motion.velocity_filter import TurnMeasured, VelocityFilter
from racecar.sensors.scan import Scan
from tests.sensors.worlds import BEARINGS, CORRIDOR, MAX_RANGE, ROOM, points_at, ranges

PERIOD = 25_000_000
SWEEP = np.linspace(0.0, 0.019, len(BEARINGS))
START = np.array([-2.0, -0.5, 0.1])
velocities = st.tuples(st.floats(-1.5, 1.5), st.floats(-0.2, 0.2), st.floats(-1.5, 1.5)).map(np.array)


def after(velocity: Pose, seconds: float | np.ndarray) -> Pose:
    """START, so many seconds later at a steady velocity (3,)."""
    return compose(START, by_velocity(velocity)(np.atleast_1d(seconds)).squeeze())


def sweep(walls: np.ndarray, velocity: Pose, seconds: float, noise: float = 0.0) -> Scan:
    """Seen beam by beam from a laser that moves."""
    seen = ranges(walls, after(velocity, seconds + SWEEP))
    seen += noise * np.random.default_rng(round(seconds * 1e3)).standard_normal(len(seen))
    return Scan(round(seconds * 1e9), BEARINGS, seen, SWEEP, IDENTITY, MAX_RANGE)


def begun(walls: np.ndarray, velocity: Pose = IDENTITY) -> VelocityFilter:
    """At START, which is the keyframe."""
    tracker = VelocityFilter()
    tracker.begin(0, IDENTITY, velocity)
    tracker.start_keyframe(prepare_scan(points_at(walls, START)))
    return tracker


def follow(
    tracker: VelocityFilter, walls: np.ndarray, velocity: Pose, scans: range, period: int = PERIOD
) -> bool:
    """Whether it could follow all of some scans."""
    return all(tracker.advance(sweep(walls, velocity, k * period * 1e-9)) for k in scans)


@settings(max_examples=20)
@given(velocities)
def test_place_and_velocity_come_to_be_known(velocity: Pose) -> None:
    """Although sweeps are bent, and at first it is unknown by how much."""
    tracker = begun(ROOM)
    assert follow(tracker, ROOM, velocity, range(1, 25))
    assert tracker.is_trusted
    moved = between(START, after(velocity, 24 * PERIOD * 1e-9))
    np.testing.assert_allclose(tracker.keyframe_from_laser, moved, atol=0.02)
    np.testing.assert_allclose(tracker.velocity, velocity, atol=0.15)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_velocity_carries_on_where_scans_show_no_distance(speed: float) -> None:
    """Along a corridor without an end every place is like the next."""
    velocity = np.array([speed, 0.0, 0.0])
    tracker = begun(CORRIDOR, velocity)
    for k in range(1, 21):
        assert tracker.advance(sweep(CORRIDOR, velocity, k * PERIOD * 1e-9, noise=0.01))
    np.testing.assert_allclose(tracker.keyframe_from_laser[0], 20 * PERIOD * 1e-9 * speed, atol=0.15)


def test_scan_odometry_counts_only_where_matches_show_no_distance() -> None:
    """A car that stops in a bare corridor would go on by its velocity; in a room the match knows better."""
    velocity = np.array([0.5, 0.0, 0.0])
    in_corridor, in_room = begun(CORRIDOR, velocity), begun(ROOM)
    for k in range(1, 16):
        for tracker, walls in ((in_corridor, CORRIDOR), (in_room, ROOM)):
            assert tracker.advance(sweep(walls, IDENTITY, 0.2 * k, noise=0.01))
        in_corridor.observe(IDENTITY)
        in_room.observe(np.array([0.5, 0.0, 0.0]))
    assert abs(in_corridor.velocity[0]) < 0.1
    assert np.hypot(*in_room.keyframe_from_laser[:2]) < 0.01


@pytest.mark.parametrize(("period", "scans"), [(PERIOD, 20), (200_000_000, 10)])
def test_it_is_not_trusted_before_it_has_followed_many_scans(period: int, scans: int) -> None:
    tracker = begun(ROOM)
    assert follow(tracker, ROOM, IDENTITY, range(1, scans), period)
    assert not tracker.is_trusted
    assert follow(tracker, ROOM, IDENTITY, range(scans, scans + 1), period)
    assert tracker.is_trusted


def test_a_late_scan_and_one_of_elsewhere_end_the_trust() -> None:
    late, elsewhere = begun(ROOM), begun(ROOM)
    for tracker in (late, elsewhere):
        follow(tracker, ROOM, IDENTITY, range(1, 25))
    assert not late.advance(sweep(ROOM, IDENTITY, 24 * PERIOD * 1e-9 + 0.3))
    assert not late.is_trusted
    leap = np.array([16.0, 0.0, 0.0])
    assert not elsewhere.advance(sweep(ROOM, leap, 25 * PERIOD * 1e-9))
    assert not elsewhere.is_trusted


def test_a_scan_without_returns_is_not_followed() -> None:
    tracker = begun(ROOM)
    blind = Scan(PERIOD, BEARINGS, np.full(len(BEARINGS), np.inf), SWEEP, IDENTITY, MAX_RANGE)
    assert not tracker.advance(blind)


def test_a_turn_that_a_gyroscope_measured_is_followed_at_once() -> None:
    """A laser ahead of where the car turns about; the scans alone would need several to notice."""
    ahead = np.array([0.3, 0.0, 0.0])
    tracker = begun(ROOM)
    rate = 1.5
    velocity = np.array([0.0, 0.3 * rate, rate])  # of the laser, as the base turns on the spot
    scan = sweep(ROOM, velocity, PERIOD * 1e-9)
    turned = TurnMeasured(rate * PERIOD * 1e-9, 1e-8, rate, ahead)
    assert tracker.advance(scan, turned=turned)
    np.testing.assert_allclose(tracker.velocity[1:], velocity[1:], atol=0.05)
    moved = between(START, after(velocity, PERIOD * 1e-9))
    assert abs(tracker.keyframe_from_laser[2] - moved[2]) < 1e-3
