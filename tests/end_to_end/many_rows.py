"""A drive through a shipped plan with a LiDAR of 16 rows; the plan's walls reach up to a ceiling."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import compose, interpolate
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.messages import POINT_CLOUD, TRANSFORMS
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.simulator import START_NS, Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.maps.shipped_plans import shipped_plan
from tests.pipelines.message_samples import cloud, header, link

SENSOR_HEIGHT, CEILING = 0.4, 2.5
BASE_FROM_SENSOR = np.array([0.2, 0.0, 0.0])
ELEVATIONS = np.radians(np.arange(-15.0, 16.0, 2.0))
TURN_TICKS = 20  # ten turns a second
MAX_RANGE, RANGE_NOISE = 100.0, 0.02
COLUMNS = ("x", "y", "z", "time")


def write_drive(folder: Path, plan: str, azimuths: int, settings: SimulationConfig) -> Trajectory:
    """Write a ROS 2 bag; returns the true ``map_from_base`` at the stamp of each cloud of 16 × azimuths."""
    grid, generator = shipped_plan(plan), np.random.default_rng(settings.seed)
    simulation = Simulation(grid, settings)
    ticks = np.arange(0, len(simulation.drive.speed) - TURN_TICKS, TURN_TICKS)
    stamps = START_NS + ticks * round(TICK * 1e9)
    odometry = iter(simulation.odometry())
    with BagWriter(folder) as writer:
        place = link("base_link", "velodyne", (*BASE_FROM_SENSOR[:2], SENSOR_HEIGHT), (0, 0, 0, 1), START_NS)
        writer.write_message("/tf_static", TRANSFORMS, place, START_NS)
        for tick, stamp in zip(ticks.tolist(), stamps.tolist(), strict=True):
            points = turn_of_sensor(grid, simulation.drive, tick, azimuths, generator)
            message = cloud(header(stamp, "velodyne"), COLUMNS, points)
            writer.write_message("/points", POINT_CLOUD, message, stamp)
            for sample in odometry:
                writer.write_odometry(sample)
                if sample.stamp >= stamp + TURN_TICKS * TICK * 1e9:
                    break
    return Trajectory(stamps, simulation.drive.map_from_base[ticks])


def turn_of_sensor(
    grid: OccupancyGrid, drive: CarMotion, tick: int, azimuths: int, generator: np.random.Generator
) -> NDArray[np.float32]:
    """(N, 4) x, y, z in the frame of the sensor and seconds since the tick; columns differ in time."""
    after = TURN_TICKS * np.arange(azimuths) / azimuths
    whole = after.astype(np.int64)
    map_from_base = interpolate(
        drive.map_from_base[tick + whole], drive.map_from_base[tick + whole + 1], after - whole
    )
    bearings = np.pi - 2 * np.pi * np.arange(azimuths) / azimuths  # clockwise, as most of them turn
    to_wall = cast_rays(grid, compose(map_from_base, BASE_FROM_SENSOR), bearings, MAX_RANGE)
    up = np.tan(ELEVATIONS)
    to_floor_or_ceiling = np.where(up < 0, -SENSOR_HEIGHT / up, (CEILING - SENSOR_HEIGHT) / up)
    across = np.minimum(to_wall[:, None], to_floor_or_ceiling)
    across += RANGE_NOISE * np.cos(ELEVATIONS) * generator.standard_normal(across.shape)
    x, y = across * np.cos(bearings)[:, None], across * np.sin(bearings)[:, None]
    times = np.broadcast_to((after * TICK)[:, None], across.shape)
    points = np.stack([x, y, across * up, times], axis=-1).reshape(-1, 4)
    return points[np.isfinite(points).all(axis=1)].astype(np.float32)
