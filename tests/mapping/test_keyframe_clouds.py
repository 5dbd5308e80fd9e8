"""On request the mapper keeps what a sensor with many rows saw at each keyframe."""

from dataclasses import replace

import numpy as np

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.state import trimming
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import transform_points
from racecar.sensors.cloud import Cloud
from racecar.sensors.scan import Scan
from tests.sensors.worlds import ROOM, scan_at

PERIOD = 100_000_000


def drive(*, keep_clouds: bool, is_planar: bool = False) -> MappingResult:
    """The map of the drive below."""
    return driven(keep_clouds=keep_clouds, is_planar=is_planar).finish()


def driven(*, keep_clouds: bool, is_planar: bool = False) -> Mapper:
    """After ten scans of a room, 0.1 m apart, of a sensor that sees each wall at three heights."""
    mapper = Mapper(MappingConfig(), keep_clouds=keep_clouds)
    for k in range(10):
        scan = scan_at(ROOM, np.array([-2.0 + 0.1 * k, -0.5, 0.1]), k * PERIOD)
        mapper.add_scan(scan if is_planar else replace(scan, cloud=seen_by_rows(scan)))
    return mapper


def seen_by_rows(scan: Scan) -> Cloud:
    points = scan.points_in_laser()
    rows = [np.column_stack([points, np.full(len(points), height)]) for height in (0.2, 0.5, 0.9)]
    cloud = np.concatenate(rows).astype(np.float32)
    return Cloud(cloud, np.zeros(len(cloud), dtype=np.float32))


def test_each_keyframe_has_its_cloud_where_the_walls_are() -> None:
    result = drive(keep_clouds=True)
    assert result.clouds is not None
    assert list(result.clouds) == list(range(len(result.keyframe_indices)))
    assert len(result.clouds) > 2
    first_from_map = np.array([-2.0, -0.5, 0.1])
    for keyframe, points in result.clouds.items():
        heights = np.unique(points[:, 2])
        assert heights.tolist() == np.array([0.2, 0.5, 0.9], dtype=np.float32).tolist()
        at_wall = transform_points(
            first_from_map, transform_points(result.session.map_from_keyframe[keyframe], points[:, :2])
        )
        corner = np.array([[-4.0, -3.0], [5.0, 4.0]])
        assert np.abs(at_wall.min(axis=0) - corner[0]).max() < 0.05
        assert np.abs(at_wall.max(axis=0) - corner[1]).max() < 0.05


def test_they_are_kept_on_request_only_and_change_nothing_else() -> None:
    asked, not_asked = drive(keep_clouds=True), drive(keep_clouds=False)
    assert not_asked.clouds is None
    assert np.array_equal(asked.trajectory.map_from_base, not_asked.trajectory.map_from_base)
    assert asked.session.to_arrays().keys() == not_asked.session.to_arrays().keys()


def test_a_planar_sensor_has_none() -> None:
    clouds = drive(keep_clouds=True, is_planar=True).clouds
    assert clouds is not None
    assert len(clouds) == 0


def test_what_is_trimmed_is_forgotten() -> None:
    mapper = driven(keep_clouds=True)
    trimming._trim_keyframes(mapper._state, np.array([1]))
    clouds = mapper.finish().clouds
    assert clouds is not None
    assert 1 not in clouds
    assert {0, 2} <= set(clouds)
