"""The driver sees the whole map, touches nothing, comes home, and does only what a car can."""

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from racecar.maps.errors import UserError
from racecar.maps.geometry.polyline import lengths_along, resample
from racecar.maps.geometry.se2 import between, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.simulation.car import BODY_CENTERS, BODY_RADIUS, MAX_STEERING, WHEELBASE, Car
from racecar.pipelines.simulation.driver import TICK, CarMotion, drive_route
from racecar.pipelines.simulation.driving_lattice import (
    MIN_TURNING_RADIUS,
    DrivingLattice,
    Route,
    clearance_field,
    curves_from,
)
from racecar.pipelines.simulation.path_smoothing import smooth_path
from racecar.pipelines.simulation.routes import choose_start, round_trip


@dataclass(frozen=True)
class Trip:
    grid: OccupancyGrid
    route: Route
    drive: CarMotion


def go(grid: OccupancyGrid, max_speed: float = 2.0, rounds: int = 1, seconds: float = np.inf) -> Trip:
    lattice = DrivingLattice(grid)
    route = round_trip(lattice, choose_start(grid, lattice, None))
    drive = drive_route(route, grid, lattice.clearance, max_speed, rounds, seconds)
    return Trip(grid, route, drive)


@pytest.fixture(scope="module")
def building() -> Trip:
    return go(load_map(shipped_map("building")), max_speed=6.0)


@pytest.fixture(scope="module")
def track() -> Trip:
    return go(load_map(shipped_map("track")), max_speed=6.0, rounds=2)


@pytest.fixture(scope="module")
def lattice(track: Trip) -> DrivingLattice:
    return DrivingLattice(track.grid)


@pytest.fixture(scope="module")
def dead_end() -> Trip:
    """A room with a corridor too narrow to turn in, the whole turned by 0.4 radians."""
    cells = np.full((120, 300), OCCUPIED, dtype=np.int8)
    cells[10:110, 10:110] = FREE
    cells[50:70, 100:280] = FREE
    return go(OccupancyGrid(cells, 0.05, np.array([5.0, -7.0, 0.4])))


TRIPS = ["building", "track", "dead_end"]


def seen_cells(trip: Trip, reach: float) -> NDArray[np.bool_]:
    """(rows, columns) the cells that rays of some reach, all round from along the way, pass over."""
    grid = trip.grid
    poses = trip.drive.map_from_base[::160]
    bearings = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    ranges = np.minimum(cast_ray_fan(grid, poses, bearings, reach), reach)
    seen = np.zeros(grid.cells.shape, dtype=np.bool_)
    headings = poses[:, 2:] + bearings
    for share in np.arange(0.0, 1.0, grid.resolution / reach):
        x = poses[:, :1] + share * ranges * np.cos(headings)
        y = poses[:, 1:2] + share * ranges * np.sin(headings)
        cells = grid.cell_of(np.column_stack([x.ravel(), y.ravel()]))
        seen[tuple(cells[grid.contains(cells)].T)] = True
    return seen


def body_clearance(trip: Trip) -> float:
    """Metres from the body's discs to the nearest edge of a cell that is not free, at its least."""
    grid = trip.grid
    half = grid.resolution / 2
    blocked = cKDTree((np.argwhere(grid.cells != 0)[:, ::-1] + 0.5) * grid.resolution)
    nearest = np.inf
    for center in BODY_CENTERS:
        map_from_body = compose(trip.drive.map_from_base[::5], [*center, 0.0])
        places = between(grid.map_from_grid, map_from_body)[:, :2]
        _, neighbours = blocked.query(places, k=4)
        outside = np.maximum(np.abs(blocked.data[neighbours] - places[:, None]) - half, 0.0)
        nearest = min(nearest, float(np.linalg.norm(outside, axis=2).min()))
    return nearest - BODY_RADIUS


@pytest.mark.parametrize("name", TRIPS)
def test_the_car_never_touches_anything(name: str, request: pytest.FixtureRequest) -> None:
    assert body_clearance(request.getfixturevalue(name)) > 0.0


@pytest.mark.parametrize("name", TRIPS)
def test_the_car_sees_the_whole_map_from_near(name: str, request: pytest.FixtureRequest) -> None:
    trip: Trip = request.getfixturevalue(name)
    regions, _ = label(trip.grid.cells == 0)
    start = trip.grid.cell_of(trip.drive.map_from_base[:1, :2])[0]
    reachable = regions == regions[tuple(start)]
    seen = seen_cells(trip, reach=4.0)
    assert np.count_nonzero(seen & reachable) > 0.95 * np.count_nonzero(reachable)


@pytest.mark.parametrize("name", TRIPS)
def test_the_car_comes_home_and_stops(name: str, request: pytest.FixtureRequest) -> None:
    drive: CarMotion = request.getfixturevalue(name).drive
    np.testing.assert_allclose(drive.map_from_base[-1, :2], drive.map_from_base[0, :2], atol=0.15)
    assert drive.speed[-1] == 0.0


@pytest.mark.parametrize("name", TRIPS)
def test_the_motion_is_that_of_a_car(name: str, request: pytest.FixtureRequest) -> None:
    drive: CarMotion = request.getfixturevalue(name).drive
    assert np.abs(drive.speed).max() <= 6.0
    sharpest = np.tan(MAX_STEERING) / WHEELBASE
    assert np.all(np.abs(drive.turning_speed) <= sharpest * np.abs(drive.speed) + 1e-9)
    steps = np.diff(drive.map_from_base[:, :2], axis=0)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), np.abs(drive.speed[1:]) * TICK, rtol=1e-3)
    middle = drive.map_from_base[:-1, 2] + 0.5 * drive.turning_speed[1:] * TICK
    aside = np.cos(middle) * steps[:, 1] - np.sin(middle) * steps[:, 0]
    np.testing.assert_allclose(aside, 0.0, atol=1e-6)


def test_the_building_is_driven_in_minutes(building: Trip) -> None:
    assert not building.route.is_lap
    assert 200.0 < building.drive.seconds < 500.0


def test_a_track_is_driven_round_without_reversing(track: Trip) -> None:
    assert track.route.is_lap
    assert np.all(track.drive.speed >= 0.0)
    assert np.abs(track.drive.speed).sum() * TICK == pytest.approx(2 * 60.0, abs=12.0)
    assert track.drive.speed.max() > 5.5


def test_a_dead_end_is_left_backwards(dead_end: Trip) -> None:
    assert np.abs(dead_end.drive.speed[dead_end.drive.speed < 0]).sum() * TICK > 4.0


def test_time_ends_a_drive(track: Trip, lattice: DrivingLattice) -> None:
    drive = drive_route(track.route, track.grid, lattice.clearance, 2.0, rounds=5, max_seconds=7.0)
    assert drive.seconds == pytest.approx(7.0, abs=0.03)


def test_the_start_can_be_chosen(track: Trip, lattice: DrivingLattice) -> None:
    wanted = np.array([16.9, 4.2, 1.4])
    node = choose_start(track.grid, lattice, wanted)
    np.testing.assert_allclose(lattice.poses_of(np.array([node]))[0], wanted, atol=0.3)


def test_a_map_without_room_is_told() -> None:
    narrow = np.full((100, 100), OCCUPIED, dtype=np.int8)
    narrow[20:30, 20:80] = FREE
    for cells in (narrow, np.full((3, 3), UNKNOWN, dtype=np.int8)):
        with pytest.raises(UserError, match="no room to drive"):
            DrivingLattice(OccupancyGrid(cells, 0.05, np.zeros(3)))


@pytest.mark.parametrize("heading", range(16))
def test_the_lattices_curves_can_be_steered(heading: int) -> None:
    for curve in curves_from(heading, 0.2):
        assert curve.length > 0.15
        steps = np.diff(curve.poses, axis=0)
        turn = np.abs((steps[:, 2] + np.pi) % (2 * np.pi) - np.pi)
        assert np.all(turn <= np.linalg.norm(steps[:, :2], axis=1) / MIN_TURNING_RADIUS * 1.02 + 1e-9)
        np.testing.assert_allclose(curve.poses[-1, :2], 0.2 * np.array(curve.offset[::-1]), atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_the_cheapest_path_costs_what_scipy_says(lattice: DrivingLattice, seed: int) -> None:
    generator = np.random.default_rng(seed)
    start, *ends = generator.choice(np.flatnonzero(lattice.reachable), size=4)
    goals = np.zeros(len(lattice.reachable), dtype=np.bool_)
    goals[ends] = True
    nodes = lattice.cheapest_path(int(start), goals)
    cost = sum(lattice.graph[a, b] for a, b in itertools.pairwise(nodes))
    assert cost == pytest.approx(dijkstra(lattice.graph, indices=int(start))[ends].min())
    path = lattice.drive(nodes).map_from_base
    np.testing.assert_allclose(path[-1], lattice.poses_of(np.array(nodes[-1:]))[0], atol=1e-9)


def test_smoothing_keeps_the_ends_and_the_distance_to_walls(building: Trip) -> None:
    clearance = clearance_field(building.grid)
    forward = building.route.map_from_base[: int(np.argmax(building.route.backwards)), :2]
    smooth = smooth_path(forward, building.grid, clearance)
    np.testing.assert_allclose(smooth[[0, -1]], forward[[0, -1]], atol=1e-9)

    def least_clearance(points: NDArray[np.float64]) -> float:
        return float(clearance[tuple(building.grid.cell_of(points).T)].min())

    assert least_clearance(smooth) >= min(0.65, least_clearance(forward)) - 0.05
    assert lengths_along(smooth)[-1] < lengths_along(forward)[-1]


@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=2, max_size=9, unique=True),
    st.floats(0.05, 2.0),
)
def test_resampling_spaces_evenly(corners: list[tuple[float, float]], step: float) -> None:
    line = np.array(corners)
    total = lengths_along(line)[-1]
    evenly = resample(line, step)
    np.testing.assert_allclose(evenly[[0, -1]], line[[0, -1]], atol=1e-9)
    assert np.all(np.linalg.norm(np.diff(evenly, axis=0), axis=1) <= max(1.5 * step, total) + 1e-9)


@given(st.floats(-3, 3), st.floats(-0.4, 0.4), st.floats(-4, 4))
def test_a_car_at_steady_steering_drives_a_circle(speed: float, steering: float, yaw: float) -> None:
    car = Car(1.0, 2.0, yaw, speed, steering)
    for _ in range(50):
        car.move(speed, steering, 0.01)
    turn = 0.5 * speed * np.tan(steering) / WHEELBASE
    assert car.yaw == pytest.approx(yaw + turn)
    chord = 0.5 * speed * np.sinc(turn / 2 / np.pi)
    np.testing.assert_allclose(
        [car.x - 1.0, car.y - 2.0],
        [chord * np.cos(yaw + turn / 2), chord * np.sin(yaw + turn / 2)],
        atol=1e-9,
    )
