"""The whole mapper on simulated drives with gaps, or a car that is moved by hand."""

from dataclasses import replace

import numpy as np
import pytest

from racecar.mapping.keyframes import constraints
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.maps.map_files import load_map
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER
from racecar.pipelines.simulation.simulator import Simulation, SimulationConfig
from racecar.sensors.scan import Scan
from tests.mapping.mapped import errors, mapped, mean_error, scans_of
from tests.maps.shipped_plans import shipped_plan


def test_without_odometry_a_fast_turn_between_few_scans_is_not_run_away_from() -> None:
    """Four scans a second at two metres a second; scan odometry loses itself now and then."""
    config = SimulationConfig(duration=30.0, max_speed=2.0)
    simulation = Simulation(shipped_plan("building"), config)
    result = mapped(scans_of(simulation.messages())[::10])
    assert errors(result, simulation.ground_truth.map_from_base[::10]).max() < 0.15


@pytest.mark.parametrize("degrees", [0, 120])
def test_a_car_that_was_moved_by_hand_while_nothing_was_recorded_is_found_again(degrees: int) -> None:
    assert error_of_a_car_moved_by_hand(degrees) < 0.05


def test_where_no_two_scans_tie_it_a_car_that_was_moved_by_hand_stays_where_it_was_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its wheels, which saw nothing of it, do not turn it back."""
    monkeypatch.setattr(constraints, "MIN_OVERLAP", 1.0)
    assert error_of_a_car_moved_by_hand(120) < 0.05


def error_of_a_car_moved_by_hand(degrees: int) -> float:
    """Metres, mean, of a drive during which it was moved on by half a metre or more and turned."""
    plan = shipped_plan("building")
    simulation = Simulation(plan, SimulationConfig(noise="slight", duration=12.0, max_speed=2.0))
    messages = list(simulation.messages())
    start, kept = messages[0].stamp, []
    before = after = IDENTITY
    is_kept = []
    for message in messages:
        seconds = (message.stamp - start) * 1e-9
        is_late = seconds >= 6.5
        if isinstance(message, Scan):
            is_kept.append(seconds < 6.0 or is_late)
        elif seconds < 6.0:
            before = message.odom_from_base
        elif not is_late:
            after = message.odom_from_base
        if 6.0 <= seconds < 6.5:
            continue
        if is_late and isinstance(message, Scan):
            message = turned_scan(message, degrees)
        elif is_late:
            pose = compose(turned(before, -degrees), between(after, message.odom_from_base))
            message = replace(message, odom_from_base=turned(pose, degrees))
        kept.append(replace(message, stamp=message.stamp + 30 * 10**9 * is_late))
    true = simulation.ground_truth.map_from_base[is_kept]
    first_late = np.count_nonzero(is_kept[:240])
    assert np.hypot(*between(true[first_late - 1], true[first_late])[:2]) > 0.5
    true[first_late:] = turned(true[first_late:], degrees)
    return mean_error(mapped(kept), true)


def turned(map_from_base: Pose, degrees: float) -> Pose:
    """Poses (..., 3) of the car turned on the spot where its laser is."""
    turn = np.array([0.0, 0.0, np.deg2rad(degrees)])
    return compose(compose(compose(map_from_base, BASE_FROM_LASER), turn), inverse(BASE_FROM_LASER))


def turned_scan(scan: Scan, degrees: int) -> Scan:
    """What the turned car sees of what the other saw."""
    beams = degrees * 4
    return replace(scan, ranges=np.concatenate([scan.ranges[beams:], np.full(beams, np.nan)]))


@pytest.mark.parametrize("gap", [(5.5, 8.0), (38.7, 8.0), (9.0, 1.8), (11.0, 1.1)])
def test_a_car_that_drove_on_while_nothing_was_recorded_is_where_its_wheels_say(
    gap: tuple[float, float],
) -> None:
    """On a ring that looks alike along its straights, and whose corners look alike."""
    began, lasted = gap
    simulation = Simulation(
        load_map("ring"), SimulationConfig(noise="slight", seed=0, duration=began + lasted + 3.0)
    )
    assert error_over_a_gap(simulation, began, lasted) < 0.02


@pytest.mark.parametrize(("began", "origin"), [(4.0, (9.0, -4.0, 1.0)), (7.0, (1.2, 1.2, -0.6))])
def test_wheels_that_begin_anew_while_nothing_was_recorded_tell_of_no_way(
    began: float, origin: tuple[float, float, float]
) -> None:
    plan = shipped_plan("building")
    simulation = Simulation(plan, SimulationConfig(noise="slight", duration=10.0, max_speed=1.0))
    assert error_over_a_gap(simulation, began, 0.7, np.array(origin)) < 0.02


def error_over_a_gap(simulation: Simulation, began: float, lasted: float, origin: Pose = IDENTITY) -> float:
    """Metres, mean, of a drive of which some seconds are missing; after them the wheels count from ``origin``
    (3,)."""
    start, kept, is_kept = int(simulation.ground_truth.stamps[0]), [], []
    for message in simulation.messages():
        seconds = (message.stamp - start) * 1e-9
        is_missing = began <= seconds < began + lasted
        if isinstance(message, Scan):
            is_kept.append(not is_missing)
        if is_missing:
            continue
        if seconds >= began and not isinstance(message, Scan):
            message = replace(message, odom_from_base=compose(origin, message.odom_from_base))
        kept.append(message)
    return mean_error(mapped(kept), simulation.ground_truth.map_from_base[is_kept])
