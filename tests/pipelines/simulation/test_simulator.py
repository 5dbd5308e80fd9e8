"""What the simulated sensors say is what they would say: walls where walls are, errors as asked for."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose, interpolate, wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.simulation import laser_sensor
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig
from racecar.pipelines.simulation.walkers import LEG_RADIUS, Walkers
from racecar.pipelines.simulation.wheel_odometry import measure_odometry
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

GRID = load_map(shipped_map("track"))
CLEAN = {"range_noise": 0.0, "dropouts": 0.0}


def simulate(**settings: object) -> Simulation:
    return Simulation(GRID, SimulationConfig.model_validate({"duration": 4.0, "max_speed": 6.0, **settings}))


@pytest.fixture(scope="module")
def clean() -> Simulation:
    return simulate(noise=NoiseLevel.NONE, **CLEAN)


def end_points(scan: Scan, map_from_base: Pose) -> NDArray[np.float64]:
    """(M, 2) in the map, from a pose (3,) or one for each beam (N, 3)."""
    map_from_laser = compose(map_from_base, scan.base_from_laser)
    x, y = scan.ranges * np.cos(scan.bearings), scan.ranges * np.sin(scan.bearings)
    ends = compose(map_from_laser, np.column_stack([x, y, scan.bearings]))
    return ends[scan.is_return, :2]


def share_on_walls(points: NDArray[np.float64]) -> float:
    """Of points (N, 2), those within a hair of an occupied cell."""
    near = np.zeros(len(points), dtype=np.bool_)
    for nudge in ((1e-6, 0.0), (-1e-6, 0.0), (0.0, 1e-6), (0.0, -1e-6)):
        near |= GRID.cells[tuple(GRID.cell_of(points + nudge).T)] == 100
    return float(near.mean())


def poses_at_beams(simulation: Simulation, scan: Scan) -> Pose:
    ticks = (scan.stamp - simulation.ground_truth.stamps[0]) / 1e9 / TICK + scan.time_offsets / TICK
    before = np.floor(ticks + 1e-6).astype(int)
    drive = simulation.drive.map_from_base
    return interpolate(drive[before], drive[before + 1], ticks - before)


def test_end_points_lie_on_walls_when_seen_from_where_the_laser_was(clean: Simulation) -> None:
    for scan in list(clean.scans())[::20]:
        points = end_points(scan, poses_at_beams(clean, scan))
        assert share_on_walls(points) > 0.99


def test_at_speed_a_scan_is_distorted_by_the_motion(clean: Simulation) -> None:
    index = int(np.argmax(np.abs(clean.drive.speed[:: UST_10LX.period_ticks][: len(clean.ground_truth)])))
    scan = list(clean.scans())[index]
    still = end_points(scan, clean.ground_truth.map_from_base[index])
    true = end_points(scan, poses_at_beams(clean, scan))
    assert np.linalg.norm(still - true, axis=1).max() > 0.05
    np.testing.assert_allclose(still[0], true[0], atol=0.002)


def test_the_truth_is_the_pose_at_each_header_stamp(clean: Simulation) -> None:
    truth = clean.ground_truth
    assert np.all(np.diff(truth.stamps) == 25_000_000)
    odometry = {sample.stamp: sample for sample in clean.true_odometry()}
    shared = [i for i, stamp in enumerate(truth.stamps.tolist()) if stamp in odometry]
    assert len(shared) >= len(truth) // 4
    for i in shared:
        np.testing.assert_array_equal(odometry[int(truth.stamps[i])].odom_from_base, truth.map_from_base[i])


def test_odometry_without_noise_is_exact(clean: Simulation) -> None:
    for measured, true in zip(clean.odometry(), clean.true_odometry(), strict=True):
        assert measured.stamp == true.stamp
        expected = between(clean.drive.map_from_base[0], true.odom_from_base)
        error = between(expected, measured.odom_from_base)
        np.testing.assert_allclose(error, 0.0, atol=1e-9)
        np.testing.assert_allclose(measured.twist, true.twist, atol=0.35)


def drift(level: NoiseLevel, seed: int, slip: float = 0.0) -> float:
    samples = measure_odometry(LAPS.drive, 0, level, slip, np.random.default_rng(seed))
    expected = between(LAPS.drive.map_from_base[0], LAPS.drive.map_from_base[(len(samples) - 1) * 4])
    return float(np.linalg.norm(between(expected, samples[-1].odom_from_base)[:2]))


LAPS = simulate(duration=None)


def test_each_noise_level_is_worse_than_the_one_before() -> None:
    slight = np.mean([drift(NoiseLevel.SLIGHT, seed) for seed in range(20)])
    full = np.mean([drift(NoiseLevel.FULL, seed) for seed in range(20)])
    assert drift(NoiseLevel.NONE, 0) < 1e-6
    assert 0.1 < slight < 3.0
    assert 2.0 * slight < full < 30.0


def test_slip_overstates_starts_and_bends_and_understates_braking() -> None:
    ticks = np.arange(401)
    accelerating = straight_drive(speed=3.0 * ticks * TICK)
    braking = straight_drive(speed=6.0 - 3.0 * ticks * TICK)
    for drive, sign in ((accelerating, 1.0), (braking, -1.0)):
        end = measure_odometry(drive, 0, NoiseLevel.NONE, 0.25, np.random.default_rng(0))[-1].odom_from_base
        assert end[0] == pytest.approx(drive.map_from_base[-1, 0] * (1.0 + sign * 0.25), rel=0.01)


def straight_drive(speed: NDArray[np.float64]) -> CarMotion:
    x = np.concatenate([[0.0], np.cumsum(speed[1:] * TICK)])
    return CarMotion(np.column_stack([x, 0 * x, 0 * x]), speed, np.zeros(len(speed)))


def test_a_standing_car_has_quiet_odometry() -> None:
    drive = straight_drive(np.zeros(401))
    for sample in measure_odometry(drive, 0, NoiseLevel.FULL, 0.2, np.random.default_rng(0)):
        np.testing.assert_array_equal(sample.odom_from_base, 0.0)
        np.testing.assert_array_equal(sample.twist, 0.0)


def test_range_noise_and_dropouts_are_as_asked_for() -> None:
    noisy, exact = simulate(duration=1.0, range_noise=0.02, dropouts=0.05), simulate(duration=1.0, **CLEAN)
    measured = np.array([scan.ranges for scan in noisy.scans()])
    true = np.array([scan.ranges for scan in exact.scans()])
    assert np.mean(np.isinf(measured[np.isfinite(true)])) == pytest.approx(0.05, abs=0.005)
    error = (measured - true)[np.isfinite(measured) & np.isfinite(true)]
    assert error.std() == pytest.approx(0.02, rel=0.05)
    assert error.mean() == pytest.approx(0.0, abs=0.001)


def test_messages_come_in_the_order_of_a_bag(clean: Simulation) -> None:
    latest = -1
    scans = 0
    for message in clean.messages():
        if isinstance(message, Odometry):
            assert message.stamp > latest
            latest = message.stamp
        else:
            scans += 1
            assert latest >= message.stamp + message.time_offsets[-1] * 1e9 - 1
    assert scans == len(clean.ground_truth)


def bag_digest(folder: Path, seed: int, level: NoiseLevel = NoiseLevel.FULL) -> str:
    simulation = simulate(duration=1.0, seed=seed, noise=level, walkers=2)
    write_bag(simulation, folder / f"{seed}.bag", lambda done: None)
    return hashlib.sha256((folder / f"{seed}.bag").read_bytes()).hexdigest()


def test_a_seed_repeats_byte_for_byte(tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    first = bag_digest(tmp_path, 7)
    assert bag_digest(tmp_path / "again", 7) == first
    assert bag_digest(tmp_path, 8) != first


@pytest.mark.parametrize("name", ["drive.bag", "drive"])
def test_the_bag_holds_what_was_simulated(tmp_path: Path, clean: Simulation, name: str) -> None:
    done: list[float] = []
    write_bag(clean, tmp_path / name, done.append)
    assert done[-1] == 1.0 and done == sorted(done)
    with BagReader(tmp_path / name, odom_topic="/odom") as reader:
        messages = list(reader)
        assert reader.base_from_laser_source == "tf_static"
        np.testing.assert_allclose(reader.base_from_laser, BASE_FROM_LASER)
    scans = [message for message in messages if isinstance(message, Scan)]
    assert [scan.stamp for scan in scans] == clean.ground_truth.stamps.tolist()
    assert [m.stamp for m in messages if isinstance(m, Odometry)] == [m.stamp for m in clean.odometry()]
    for scan, made in zip(scans, clean.scans(), strict=True):
        np.testing.assert_array_equal(scan.ranges, made.ranges)
    np.testing.assert_allclose(scans[0].time_offsets, UST_10LX.time_offsets, atol=1e-6)
    np.testing.assert_allclose(scans[0].bearings, UST_10LX.bearings, atol=1e-4)


@given(
    distance=st.floats(0.5, 20.0),
    bearing=st.floats(-3.1, 3.1),
    pose=st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1)),
)
def test_a_leg_is_seen_where_and_as_wide_as_it_is(
    distance: float, bearing: float, pose: tuple[float, float, float]
) -> None:
    empty = OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, np.zeros(3))
    drive = CarMotion(np.tile(pose, (10, 1)), np.zeros(10), np.zeros(10))
    leg = compose(
        compose(np.array(pose), BASE_FROM_LASER),
        [distance * np.cos(bearing), distance * np.sin(bearing), 0.0],
    )[None, :2]
    poses = laser_sensor.poses_at_beams(drive, 0, UST_10LX)
    ranges = laser_sensor.see_walls(empty, poses, UST_10LX)
    laser_sensor.see_legs(ranges, poses, UST_10LX, (leg, leg), LEG_RADIUS)
    off_center = np.abs(wrap_angle(UST_10LX.bearings - bearing))
    half_width = np.arcsin(LEG_RADIUS / distance)
    sure = np.abs(off_center - half_width) > 1e-9
    np.testing.assert_array_equal(np.isfinite(ranges)[sure], (off_center < half_width)[sure])
    if off_center.min() < 1e-3:
        assert ranges.min() == pytest.approx(distance - LEG_RADIUS, abs=5e-3)


def test_walkers_walk_in_the_free_at_a_persons_pace() -> None:
    lattice = DrivingLattice(GRID)
    walkers = Walkers(4, lattice, np.random.default_rng(5))
    places = np.array([walkers.walk(0.1) for _ in range(600)])
    assert places.shape == (600, 8, 2)
    assert np.all(GRID.cells[tuple(GRID.cell_of(places.reshape(-1, 2)).T)] == 0)
    persons = places.reshape(600, 4, 2, 2).mean(axis=2)
    paces = np.linalg.norm(np.diff(persons, axis=0), axis=2) / 0.1
    assert paces.max() < 1.6
    assert np.all(np.ptp(persons, axis=0).max(axis=1) > 2.0)


def test_walkers_are_seen_and_hide_what_is_behind_them() -> None:
    alone, crowded = simulate(duration=2.0, **CLEAN), simulate(duration=2.0, walkers=20, **CLEAN)
    differences = [a.ranges - b.ranges for a, b in zip(alone.scans(), crowded.scans(), strict=True)]
    stacked = np.nan_to_num(np.array(differences))
    assert np.all(stacked >= 0.0)
    assert np.count_nonzero(stacked > 0.1) > 1000


@pytest.mark.parametrize(
    "wrong", [{"speed": 2.0}, {"max_speed": 0.0}, {"walkers": -1}, {"noise": "some"}, {"slip": 1.0}]
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(UserError):
        SimulationConfig.model_validate(wrong)


@pytest.mark.parametrize("rate", [10.0, 200.0])
def test_the_gyroscope_says_how_fast_the_car_turns_but_for_a_bias(rate: float) -> None:
    simulation = simulate(imu_rate=rate)
    drive, samples = simulation.drive, simulation.yaw_rates()
    seconds = np.array([sample.stamp - simulation.ground_truth.stamps[0] for sample in samples]) * 1e-9
    np.testing.assert_allclose(np.diff(seconds), 1.0 / rate, atol=1e-8)
    true = np.interp(seconds, TICK * np.arange(len(drive.turning_speed)), drive.turning_speed)
    missed = np.array([sample.rate for sample in samples]) - true
    assert np.degrees(abs(np.median(missed))) < 5.0
    assert np.degrees((missed - np.median(missed)).std()) < 1.0
    assert len({sample.rate for sample in samples}) == len(samples)


def test_a_car_without_gyroscope_drives_and_measures_as_with_one() -> None:
    without, with_one = list(simulate().messages()), list(simulate(imu_rate=100.0).messages())
    others = [message for message in with_one if not isinstance(message, YawRate)]
    assert not any(isinstance(message, YawRate) for message in without)
    assert [message.stamp for message in without] == [message.stamp for message in others]
    assert len(with_one) - len(others) == 401
    covered = 0
    for message in with_one[: with_one.index(others[-5])]:
        if isinstance(message, YawRate):
            covered = message.stamp
        elif isinstance(message, Scan):
            assert covered >= message.stamp + round(message.time_offsets[-1] * 1e9)


def test_a_bag_with_an_imu_is_read_as_it_was_simulated(tmp_path: Path) -> None:
    simulation = simulate(imu_rate=100.0, duration=1.0)
    write_bag(simulation, tmp_path / "drive.bag", lambda share: None)
    with BagReader(tmp_path / "drive.bag") as reader:
        read = [(item.stamp, item.rate) for item in reader if isinstance(item, YawRate)]
    assert read == [(sample.stamp, sample.rate) for sample in simulation.yaw_rates()]


def test_what_is_seen_over_hills_by_whoever_looks_twice_is_the_same() -> None:
    simulation = simulate(duration=1.0, hills=0.1, tilt=3.0, posts=2, follower=True, walkers=2)
    first, second = (np.array([scan.ranges for scan in simulation.scans()]) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def heading_drift(seed: int) -> tuple[float, float]:
    """Degrees per metre on a straight, and the share by which a bend is over- or understated beyond that."""
    ticks = np.arange(2001)
    speed, turning = np.full(2001, 1.0), np.full(2001, 0.3)
    yaw = 0.3 * TICK * ticks
    bend = CarMotion(
        np.column_stack([np.sin(yaw) / 0.3, (1.0 - np.cos(yaw)) / 0.3, wrap_angle(yaw)]), speed, turning
    )
    turned = []
    for drive in (straight_drive(speed), bend):
        samples = measure_odometry(
            drive, 0, NoiseLevel.NONE, 0.0, np.random.default_rng(seed), by_steering=True
        )
        turned.append(np.degrees(np.unwrap([sample.odom_from_base[2] for sample in samples])[-1]))
    return turned[0] / 10.0, (turned[1] - turned[0]) / np.degrees(3.0) - 1.0


def test_odometry_by_a_steering_angle_drifts_with_the_distance_and_misjudges_bends() -> None:
    drifts = np.array([heading_drift(seed) for seed in range(12)])
    assert np.all((np.abs(drifts[:, 0]) > 0.7) & (np.abs(drifts[:, 0]) < 1.6))
    assert np.all((np.abs(drifts[:, 1]) > 0.02) & (np.abs(drifts[:, 1]) < 0.08))
    assert np.all(drifts.min(axis=0) < 0.0) and np.all(drifts.max(axis=0) > 0.0)


def test_a_standing_car_does_not_turn_by_its_steering() -> None:
    drive = straight_drive(np.zeros(401))
    for sample in measure_odometry(
        drive, 0, NoiseLevel.NONE, 0.0, np.random.default_rng(0), by_steering=True
    ):
        np.testing.assert_array_equal(sample.odom_from_base, 0.0)
