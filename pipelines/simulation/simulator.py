"""A simulated drive through a map: the car's motion, and the measurements of its laser and wheels."""

import heapq
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.simulation import laser_sensor
from racecar.pipelines.simulation.driver import TICK, CarMotion, drive_route
from racecar.pipelines.simulation.driving_lattice import DrivingLattice, Route
from racecar.pipelines.simulation.gyroscope import measure_yaw_rates
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, LASERS, LaserModel
from racecar.pipelines.simulation.routes import choose_start, round_trip
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.pipelines.simulation.surroundings import Surroundings
from racecar.pipelines.simulation.wheel_odometry import measure_odometry, true_odometry
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

START_NS = 1_700_000_000_000_000_000
"""Nanoseconds, the first stamp of a simulated drive: in 2023, so that stamps look like those of real bags."""
GAP_PERIOD = 15.0
"""Seconds between the ends of successive gaps, as in logs written to a disk that is too slow."""


_Message: TypeAlias = Scan | YawRate | tuple[Odometry, Odometry]
"""A scan, a yaw rate, or measured and true odometry."""


class Simulation:
    """A completed drive; its scans are generated on reading. The same settings give the same drive."""

    def __init__(self, grid: OccupancyGrid, config: SimulationConfig) -> None:
        """Plan and drive. Raises UserError when the map has no room for the car."""
        self._grid, self._config = grid, config
        self._lattice = _lattice_of(grid)
        self.drive = self._drive()
        self.laser = LASERS[config.laser]
        self._scan_ticks = kept_ticks(
            laser_sensor.scan_ticks(self.drive, self.laser), config.scan_every, config.scan_gaps
        )
        self.ground_truth = Trajectory(_stamps(self._scan_ticks), self.drive.map_from_base[self._scan_ticks])
        """Exact ``map_from_base`` at the stamp of each scan."""

    def odometry(self) -> list[Odometry]:
        """Wheel odometry, 50 times a second."""
        generator = np.random.default_rng([self._config.seed, 1])
        config = self._config
        return measure_odometry(
            self.drive,
            START_NS,
            config.noise,
            config.slip,
            generator,
            by_steering=config.steering,
            carried=config.carried,
        )

    def yaw_rates(self) -> list[YawRate]:
        """Gyroscope readings; empty if the car has none."""
        if self._config.imu_rate == 0.0:
            return []
        generator = np.random.default_rng([self._config.seed, 4])
        return measure_yaw_rates(self.drive, START_NS, self._config.imu_rate, generator)

    def true_odometry(self) -> Iterator[Odometry]:
        """The car's true pose and twist in the map, 50 times a second."""
        return true_odometry(self.drive, START_NS)

    def scans(self) -> Iterator[Scan]:
        """Laser scans, one sweep at a time."""
        laser, config = self.laser, self._config
        generator = np.random.default_rng([config.seed, 2])
        noise = laser.noise if config.range_noise is None else config.range_noise
        dropouts = laser.dropouts if config.dropouts is None else config.dropouts
        surroundings = Surroundings(self._grid, self._lattice, self.drive, config)
        for tick, stamp in zip(self._scan_ticks.tolist(), self.ground_truth.stamps.tolist(), strict=True):
            measured = laser_sensor.measure(surroundings.see(tick), laser, noise, dropouts, generator)
            yield laser.scan(stamp, measured)

    def messages(self) -> Iterator[Measurement]:
        """Measurements as from a bag: a scan follows the motion that covers its last beam."""
        yaw_rates = self.yaw_rates()
        covered: dict[type, int] = dict.fromkeys([Odometry, YawRate] if yaw_rates else [Odometry], 0)
        motion: Iterator[Odometry | YawRate] = heapq.merge(yaw_rates, self.odometry(), key=_stamp_of)
        for scan in self.scans():
            end = scan.stamp + round(scan.time_offsets[-1] * 1e9)
            for sample in motion:
                yield sample
                covered[type(sample)] = sample.stamp
                if min(covered.values()) >= end:
                    break
            yield scan
        yield from motion

    def _drive(self) -> CarMotion:
        config = self._config
        route = _route_through(self._grid, config.start)
        rounds, seconds = (config.laps if route.is_lap else 1), np.inf
        if config.duration is not None:
            # The rounds needed at constant full speed, so that the car never runs out of them.
            rounds = 1 + int(config.duration * config.max_speed / route.length)
            seconds = config.duration
        return drive_route(route, self._grid, self._lattice.clearance, config.max_speed, rounds, seconds)


@lru_cache(maxsize=2)
def _lattice_of(grid: OccupancyGrid) -> DrivingLattice:
    """Cached, since a lattice takes seconds and is shared by all drives through the same grid object."""
    return DrivingLattice(grid)


@lru_cache(maxsize=8)
def _route_through(grid: OccupancyGrid, start: tuple[float, float, float] | None) -> Route:
    """The round trip from the place nearest to a pose in the map, cached for further drives."""
    lattice = _lattice_of(grid)
    wanted = None if start is None else np.array(start)
    return round_trip(lattice, choose_start(grid, lattice, wanted))


def ground_truth_file(bag: Path) -> Path:
    """File of the ground truth of a simulated bag, beside it and named after it."""
    folder, name = (bag.parent, bag.name) if bag.name else (bag.absolute().parent, bag.absolute().name)
    return folder / f"{name.removesuffix('.bag')}.ground_truth.tum"


def write_bag(simulation: Simulation, path: Path, progress: Callable[[float], None]) -> None:
    """Write ``/scan``, ``/odom``, ``/ground_truth`` and ``/tf_static``, and ``/imu`` if the car has one;
    progress goes from 0 to 1.

    Raises UserError when the bag cannot be written.
    """
    scans = len(simulation.ground_truth)
    samples: Iterator[_Message] = zip(simulation.odometry(), simulation.true_odometry(), strict=True)
    sweeps: Iterator[_Message] = simulation.scans()
    yaw_rates: Iterator[_Message] = iter(simulation.yaw_rates())
    messages = heapq.merge(samples, sweeps, yaw_rates, key=_stamp_of)
    with BagWriter(path) as writer:
        writer.write_static_transform(BASE_FROM_LASER)
        written = 0
        for message in messages:
            if isinstance(message, Scan):
                _write_scan(writer, message, simulation.laser)
                written += 1
                progress(written / scans)
            elif isinstance(message, YawRate):
                writer.write_yaw_rate(message)
            else:
                measured, true = message
                writer.write_odometry(measured)
                writer.write_odometry(true, topic="/ground_truth", frame_id="map")


def _stamp_of(message: _Message | Odometry) -> int:
    return message[0].stamp if isinstance(message, tuple) else message.stamp


def _write_scan(writer: BagWriter, scan: Scan, laser: LaserModel) -> None:
    writer.write_scan(
        scan.stamp,
        scan.ranges.astype(np.float32),
        laser.angle_min,
        laser.angle_increment,
        laser.time_increment,
        laser.scan_time,
        laser.range_min,
        laser.range_max,
    )


def _stamps(ticks: NDArray[np.int64]) -> NDArray[np.int64]:
    return START_NS + ticks * round(TICK * 1e9)


def kept_ticks(ticks: NDArray[np.int64], every: float, gaps: float) -> NDArray[np.int64]:
    """(K,) start ticks of the sweeps that are written, out of those of all sweeps (S,).

    At most one is kept per ``every`` seconds, and none in the last ``gaps`` seconds of each 15.
    """
    seconds = TICK * ticks
    written = ticks[seconds % GAP_PERIOD < GAP_PERIOD - gaps]
    if every == 0.0:
        return written
    period = round(every / TICK)
    kept, due = [], 0
    for tick in written.tolist():
        if tick >= due:
            kept.append(tick)
            due = tick + period
    return np.array(kept, dtype=np.int64)
