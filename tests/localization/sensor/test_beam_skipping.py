import numpy as np
import pytest

from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beam_skipping import Alignment, explain
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, beam_model_of, free_space_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

PLACE = np.array([9.0, 4.0, 2.4])


@pytest.fixture(scope="module", params=["beam model with a table", "beam model without"])
def sensor(request: pytest.FixtureRequest) -> BeamModel:
    return sensor_of(request.param, room())


def sensor_of(name: str, grid: OccupancyGrid) -> BeamModel:
    free_space = free_space_of(grid)
    return beam_model_of(free_space, with_table=name == "beam model with a table")


def truth() -> Pose:
    return compose(room().map_from_grid, PLACE)


def cloud_about(pose: Pose, metres: float = 0.03, radians: float = 0.01) -> Pose:
    noise = np.random.default_rng(1).standard_normal((500, 3))
    return np.asarray(pose + [metres, metres, radians] * noise)


def seen_in(grid: OccupancyGrid) -> np.ndarray:
    """(271,) ranges from the place."""
    exact = cast_ray_fan(grid, compose(truth(), BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    return np.asarray(exact + 0.01 * np.random.default_rng(0).standard_normal(len(exact)))


def beams_of(ranges: np.ndarray) -> Beams:
    return Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0)


def kept_of(beams: Beams, cloud: np.ndarray, aligned: np.ndarray, sensor: BeamModel) -> Beams:
    return explain(beams, cloud, lambda: (aligned, np.eye(3)), sensor, CONFIG.beam_skipping).beams


def is_left(kept: Beams) -> np.ndarray:
    """(271,) which beams were not left out."""
    return np.isin(BEARINGS, kept.bearings)


def test_beams_on_walls_stay(sensor: BeamModel) -> None:
    kept = kept_of(beams_of(seen_in(room())), cloud_about(truth()), truth(), sensor)
    assert is_left(kept).mean() > 0.93


def test_people_are_left_out_and_walls_stay(sensor: BeamModel) -> None:
    ranges = seen_in(room())
    are_people = np.zeros(271, dtype=np.bool_)
    for first in (40, 90, 150, 200):
        are_people[first : first + 12] = True
    ranges[are_people] = 1.0
    kept = is_left(kept_of(beams_of(ranges), cloud_about(truth()), truth(), sensor))
    assert not kept[are_people].any()
    assert kept[~are_people].mean() > 0.93


def test_what_was_put_there_since_the_map_was_made_is_left_out(sensor: BeamModel) -> None:
    real = room()
    real.cells[60:100, 138:146] = OCCUPIED
    is_box = seen_in(real) < seen_in(room()) - 0.7
    assert is_box.sum() > 40
    kept = is_left(kept_of(beams_of(seen_in(real)), cloud_about(truth()), truth(), sensor))
    assert kept[is_box].mean() < 0.1
    assert kept[~is_box].mean() > 0.85


def test_beams_that_look_through_what_was_taken_away_are_left_out(sensor: BeamModel) -> None:
    real = room()
    real.cells[70:90, 100:125] = FREE
    looks_through = seen_in(real) > seen_in(room()) + 0.7
    assert looks_through.sum() > 20
    kept = is_left(kept_of(beams_of(seen_in(real)), cloud_about(truth()), truth(), sensor))
    assert not kept[looks_through].any()
    assert kept[~looks_through].mean() > 0.93


def test_all_beams_stay_where_too_few_would(sensor: BeamModel) -> None:
    ranges = np.where(np.arange(271) % 3 == 0, seen_in(room()), 1.0)
    beams = beams_of(ranges)
    assert kept_of(beams, cloud_about(truth()), truth(), sensor) is beams
    ranges = np.where(np.arange(271) % 5 < 3, seen_in(room()), 1.0)
    assert len(kept_of(beams_of(ranges), cloud_about(truth()), truth(), sensor)) <= 163


def test_the_scan_aligned_with_walls_decides_while_the_cloud_is_beside_the_place(sensor: BeamModel) -> None:
    ranges = seen_in(room())
    are_people = (np.arange(271) >= 90) & (np.arange(271) < 140)
    ranges[are_people] = 1.0
    beside = cloud_about(compose(truth(), [0.22, -0.18, 0.04]))
    by_walls = is_left(kept_of(beams_of(ranges), beside, truth(), sensor))
    by_cloud = is_left(kept_of(beams_of(ranges), beside, beside[0], sensor))
    np.testing.assert_array_equal(by_walls, sensor.fits(truth()[None], beams_of(ranges))[0])
    assert by_walls[~are_people].mean() > by_cloud[~are_people].mean() + 0.1
    assert not by_walls[are_people].any()


def test_a_pose_that_fits_hardly_better_than_the_cloud_does_not_decide(sensor: BeamModel) -> None:
    ranges, cloud = seen_in(room()), cloud_about(truth())
    shifted = compose(truth(), [0.1, 0.0, 0.0])
    kept = kept_of(beams_of(ranges), cloud, shifted, sensor)
    np.testing.assert_array_equal(is_left(kept), is_left(kept_of(beams_of(ranges), cloud, truth(), sensor)))


def test_a_beam_needs_most_of_the_cloud(sensor: BeamModel) -> None:
    beams, off_the_map = beams_of(seen_in(room())), np.array([1e6, 1e6, 0.0])
    poses = np.array([truth(), compose(truth(), [0.0, 0.2, 0.03])])
    fits = sensor.fits(poses, beams)
    assert np.all(fits, axis=0).mean() > 0.5
    assert fits[1].mean() < 0.9
    for tenths_aside, expected in ((2, fits[0]), (5, np.all(fits, axis=0)), (8, fits[1])):
        cloud = poses[(np.arange(1000) // 100 < tenths_aside).astype(np.int64)]
        np.testing.assert_array_equal(is_left(kept_of(beams, cloud, off_the_map, sensor)), expected)


def test_the_scan_is_not_aligned_where_that_cannot_explain_more(sensor: BeamModel) -> None:
    def never() -> Alignment:
        raise AssertionError

    beams = beams_of(seen_in(room()))
    explained = explain(beams, cloud_about(truth()), never, sensor, CONFIG.beam_skipping)
    assert len(explained.beams) >= 0.9 * len(beams)
    assert explained.better is None


def test_where_the_scan_fits_notably_better_is_reported(sensor: BeamModel) -> None:
    beams, covariance = beams_of(seen_in(room())), 0.01 * np.eye(3)
    beside = cloud_about(compose(truth(), [0.45, -0.35, 0.12]))
    better = explain(beams, beside, lambda: (truth(), covariance), sensor, CONFIG.beam_skipping).better
    assert better is not None
    np.testing.assert_array_equal(better[0], truth())
    assert better[1] is covariance
    explained = explain(beams, beside, lambda: (beside[0], covariance), sensor, CONFIG.beam_skipping)
    assert explained.better is None


def evidence_of(share_of_people: float, cloud: Pose, sensor: BeamModel) -> float:
    ranges = seen_in(room())
    ranges[: round(share_of_people * len(ranges))] = 0.8
    return explain(
        beams_of(ranges), cloud, lambda: (truth(), np.eye(3)), sensor, CONFIG.beam_skipping
    ).evidence


def test_a_scan_of_which_little_fits_counts_less(sensor: BeamModel) -> None:
    evidence = [evidence_of(people, cloud_about(truth()), sensor) for people in (0.0, 0.2, 0.4, 0.6, 0.8)]
    assert evidence[:2] == [1.0, 1.0]
    assert np.all(np.diff(evidence[1:]) < 0.0)
    assert evidence[3] < 0.2
    assert 0.0 < evidence[4] < 0.02


def test_a_scan_that_fits_beside_the_cloud_counts_by_how_it_fits_there(sensor: BeamModel) -> None:
    beside = cloud_about(compose(truth(), [0.45, -0.35, 0.12]))
    assert evidence_of(0.2, beside, sensor) == 1.0
