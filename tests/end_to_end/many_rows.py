"""A drive through a shipped plan with a LiDAR of 16 rows; the plan's walls reach up to a ceiling."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import compose, interpolate
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.messages import POINT_CLOUD, TRANSFORMS, ros2_types
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.simulator import START_NS, Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.maps.shipped_plans import shipped_plan

SENSOR_HEIGHT, CEILING = 0.4, 2.5
BASE_FROM_SENSOR = np.array([0.2, 0.0, 0.0])
ELEVATIONS = np.radians(np.arange(-15.0, 16.0, 2.0))
TURN_TICKS = 20  # ten turns a second
MAX_RANGE, RANGE_NOISE = 100.0, 0.02
COLUMNS = ("x", "y", "z", "time")
TYPES = ros2_types().types


def write_drive(folder: Path, plan: str, azimuths: int, settings: SimulationConfig) -> Trajectory:
    """Write a ROS 2 bag; returns the true ``map_from_base`` at the stamp of each cloud of 16 × azimuths."""
    grid, generator = shipped_plan(plan), np.random.default_rng(settings.seed)
    simulation = Simulation(grid, settings)
    ticks = np.arange(0, len(simulation.drive.speed) - TURN_TICKS, TURN_TICKS)
    stamps = START_NS + ticks * round(TICK * 1e9)
    odometry = iter(simulation.odometry())
    with BagWriter(folder) as writer:
        writer.write_message("/tf_static", TRANSFORMS, place_of_sensor(), START_NS)
        for tick, stamp in zip(ticks.tolist(), stamps.tolist(), strict=True):
            points = turn_of_sensor(grid, simulation.drive, tick, azimuths, generator)
            writer.write_message("/points", POINT_CLOUD, as_message(points, stamp), stamp)
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


def as_message(points: NDArray[np.float32], stamp: int) -> Any:
    """As drivers of such sensors publish them."""
    field = TYPES["sensor_msgs/msg/PointField"]
    return TYPES[POINT_CLOUD](
        header=header(stamp, "velodyne"),
        height=1,
        width=len(points),
        fields=[field(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(COLUMNS)],
        is_bigendian=False,
        point_step=16,
        row_step=16 * len(points),
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )


def place_of_sensor() -> Any:
    x, y, _ = BASE_FROM_SENSOR
    transform = TYPES["geometry_msgs/msg/Transform"](
        translation=TYPES["geometry_msgs/msg/Vector3"](x=float(x), y=float(y), z=SENSOR_HEIGHT),
        rotation=TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
    )
    stamped = TYPES["geometry_msgs/msg/TransformStamped"](
        header=header(START_NS, "base_link"), child_frame_id="velodyne", transform=transform
    )
    return TYPES[TRANSFORMS](transforms=[stamped])


def header(stamp: int, frame: str) -> Any:
    time = TYPES["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    return TYPES["std_msgs/msg/Header"](stamp=time, frame_id=frame)
