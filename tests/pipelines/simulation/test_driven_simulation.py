"""A car that is driven by goals and by hand, and what it measures meanwhile."""

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose, inverse, transform_points
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.simulation.laser_models import LASERS
from racecar.pipelines.simulation.simulator_config import LaserKind, NoiseLevel
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan


def a_room() -> OccupancyGrid:
    """8 x 6 m, with a wall in its middle that leaves a passage at the top."""
    cells = np.full((120, 160), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[:70, 78:82] = OCCUPIED
    return OccupancyGrid(cells, 0.05, np.zeros(3))


GRID = a_room()


def a_drive(conditions: Conditions | None = None) -> DrivenSimulation:
    return DrivenSimulation(
        GRID, conditions or Conditions(noise=NoiseLevel.NONE), start=np.array([2.0, 2.0, 0.0])
    )


def drive_on(simulation: DrivenSimulation, seconds: float = 30.0) -> list[Measurement]:
    """Until the goal is reached, or so many seconds."""
    measured = simulation.advance(0.1)
    while simulation.is_underway and simulation.seconds < seconds:
        measured += simulation.advance(0.1)
    return measured


def scans_of(measured: list[Measurement]) -> list[Scan]:
    return [each for each in measured if isinstance(each, Scan)]


def odometry_of(measured: list[Measurement]) -> list[Odometry]:
    return [each for each in measured if isinstance(each, Odometry)]


@pytest.mark.parametrize("goal", [(6.0, 1.5), (2.5, 4.5), (7.0, 5.0)])
def test_the_car_drives_round_walls_to_the_goal(goal: tuple[float, float]) -> None:
    simulation = a_drive()
    simulation.drive_to(np.array(goal))
    drive_on(simulation)
    assert not simulation.is_underway
    assert np.linalg.norm(simulation.truth[:2] - goal) < 0.3


def test_a_goal_with_a_heading_is_reached_with_it() -> None:
    simulation = a_drive()
    simulation.drive_to(np.array([6.0, 3.0, -np.pi / 2]))
    drive_on(simulation, 60.0)
    np.testing.assert_allclose(simulation.truth, [6.0, 3.0, -np.pi / 2], atol=0.3)


def test_a_goal_where_the_car_cannot_stand_is_refused() -> None:
    with pytest.raises(UserError, match="cannot get there"):
        a_drive().drive_to(np.array([12.0, 3.0]))


def test_true_wheels_report_where_the_car_went() -> None:
    simulation = a_drive()
    start = simulation.truth
    simulation.drive_to(np.array([6.0, 1.5]))
    last = odometry_of(drive_on(simulation))[-1]
    np.testing.assert_allclose(compose(start, last.odom_from_base), simulation.truth, atol=0.01)


def test_wheels_slip_when_they_are_to_slip() -> None:
    simulation = a_drive(Conditions(noise=NoiseLevel.NONE, slip=0.5))
    start = simulation.truth
    simulation.drive_to(np.array([6.0, 1.5]))
    last = odometry_of(drive_on(simulation))[-1]
    assert np.linalg.norm(compose(start, last.odom_from_base)[:2] - simulation.truth[:2]) > 0.1


def test_scans_show_the_walls_and_follow_the_odometry_that_covers_them() -> None:
    simulation = a_drive()
    simulation.drive_to(np.array([2.5, 4.5]))
    measured = drive_on(simulation)
    scans = scans_of(measured)
    assert len(scans) == pytest.approx(20 * simulation.seconds, abs=2)
    latest = 0
    for each in measured:
        if isinstance(each, Scan):
            assert each.stamp + round(each.time_offsets[-1] * 1e9) <= latest
        else:
            latest = each.stamp
    last = simulation.advance(0.2)
    seen = transform_points(simulation.truth, scans_of(last)[-1].points_in_base())
    is_wall = GRID.cells[tuple(GRID.cell_of(seen).T)] == OCCUPIED
    shifts = 0.05 * np.vstack([np.eye(2), -np.eye(2)])
    near = [GRID.cells[tuple(GRID.cell_of(seen + shift).T)] == OCCUPIED for shift in shifts]
    assert np.mean(is_wall | np.any(near, axis=0)) > 0.9


def test_neither_wheels_nor_laser_notice_that_the_car_is_carried() -> None:
    simulation = a_drive()
    simulation.advance(0.2)
    simulation.put_at(np.array([6.5, 4.5, 1.0]))
    measured = simulation.advance(0.3)
    np.testing.assert_allclose(odometry_of(measured)[-1].odom_from_base, 0.0, atol=1e-9)
    seen = scans_of(measured)[-1].points_in_base()
    corner = transform_points(inverse(simulation.truth), np.array([[7.85, 5.85]]))[0]
    assert np.linalg.norm(seen - corner, axis=1).min() < 0.1
    with pytest.raises(UserError, match="does not fit"):
        simulation.put_at(np.array([4.0, 1.0, 0.0]))


@pytest.mark.parametrize("kind", LaserKind)
def test_every_laser_sweeps_as_often_as_it_turns_but_no_more_than_it_is_asked(kind: LaserKind) -> None:
    simulation = DrivenSimulation(GRID, Conditions(noise=NoiseLevel.NONE), laser=kind)
    scans = scans_of(simulation.advance(3.0))
    period = max(0.05, LASERS[kind].scan_time)
    np.testing.assert_allclose(np.diff([scan.stamp for scan in scans]), 1e9 * period, atol=1.0)
    assert len(scans) == pytest.approx(3.0 / period, abs=2)
    assert {len(scan.ranges) for scan in scans} == {LASERS[kind].beams}


def test_stamps_begin_when_the_drive_does() -> None:
    simulation = a_drive()
    simulation.start_ns = 5_000_000_000
    assert odometry_of(simulation.advance(0.02))[0].stamp == 5_020_000_000


def test_a_covered_laser_sees_nothing_and_dropped_scans_do_not_come() -> None:
    simulation = a_drive()
    simulation.change(is_blocked=True)
    assert not any(scan.is_return.any() for scan in scans_of(simulation.advance(0.5)))
    simulation.change(is_blocked=False)
    simulation.change(dropped_scans=0.5)
    assert 2 < len(scans_of(simulation.advance(1.0))) < 18


def test_by_hand_the_car_stops_at_a_wall_and_when_nobody_steers() -> None:
    simulation = a_drive()
    for _ in range(30):
        simulation.steer(1.0, 0.0)
        simulation.advance(0.2)
    assert 3.0 < simulation.truth[0] < 3.6
    assert simulation.speed == 0.0
    simulation.steer(-1.0, 0.0)
    simulation.advance(0.4)
    assert simulation.is_steered
    assert simulation.speed < 0.0
    simulation.advance(2.0)
    assert not simulation.is_steered
    assert simulation.speed == 0.0


def test_persons_walk_and_are_seen() -> None:
    simulation = a_drive(Conditions(noise=NoiseLevel.NONE, walkers=2))
    simulation.advance(0.2)
    before = simulation.legs
    assert before.shape == (4, 2)
    simulation.advance(1.0)
    assert np.all(np.linalg.norm(simulation.legs - before, axis=1) > 0.1)


def test_memory_does_not_grow_with_the_drive() -> None:
    simulation = a_drive()
    simulation.drive_to(np.array([6.0, 1.5]))
    drive_on(simulation)
    assert len(simulation._trace) < 30
