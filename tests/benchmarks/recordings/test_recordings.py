"""The exhaustive match of scans, and the localizer beside it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.recordings.exhaustive_matcher import ExhaustiveMatcher, ScanSegment
from benchmarks.recordings.exhaustive_matcher_kernels import mean_fits
from benchmarks.recordings.localized_scans import LocalizedScans, localize
from benchmarks.recordings.recordings import (
    ScanComparison,
    compare_scans,
    find_recordings,
    match_recording,
    recording_figures,
)
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.sensor.end_points import EndPoints, select_points
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, transform_points, wrap_angle
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig
from racecar.sensors.scan import Scan

BEARINGS = np.linspace(-2.3, 2.3, 271)
BASE_FROM_LASER = np.array([0.3, 0.1, 0.2])
MAP_FROM_GRID = np.array([5.0, -2.0, 3.0])


def rooms(map_from_grid: Pose = IDENTITY) -> OccupancyGrid:
    """Two rooms and a door between them; nothing in them looks like anything else."""
    cells = np.full((100, 160), OCCUPIED, dtype=np.int8)
    cells[3:97, 3:90] = FREE
    cells[3:70, 94:157] = FREE
    cells[30:45, 90:94] = FREE
    cells[70:85, 20:35] = cells[10:16, 60:75] = cells[50:56, 120:150] = OCCUPIED
    return OccupancyGrid(cells, 0.1, map_from_grid)


def scan_from(grid: OccupancyGrid, map_from_base: Pose) -> Scan:
    map_from_laser = compose(map_from_base, BASE_FROM_LASER)
    ranges = cast_ray_fan(grid, map_from_laser[None], BEARINGS, 30.0)[0]
    return Scan(0, BEARINGS, ranges, np.zeros(len(BEARINGS)), BASE_FROM_LASER, 30.0)


def points_of(scan: Scan) -> EndPoints:
    """Of a car that stands."""
    return EndPoints(scan.points_in_base(), scan.base_from_laser[:2])


def alone(scan: Scan) -> ScanSegment:
    return ScanSegment([points_of(scan)], IDENTITY[None])


def own_trajectory(drive: SimulatedDrive) -> Trajectory:
    """On a map with another frame."""
    return Trajectory(drive.truth.stamps, compose([5.0, -2.0, 1.0], drive.truth.map_from_base))


@pytest.fixture(scope="module")
def drive() -> SimulatedDrive:
    return simulate_drive(rooms(), SimulationConfig(duration=2.0, seed=3, start=(3.0, 4.0, 0.3)))


def test_points_fit_by_their_distance_from_walls() -> None:
    distances = np.array([[0.0, 0.1, 0.2]], dtype=np.float32)
    points = np.array([[0.05, 0.05], [0.15, 0.05]])
    poses = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.0, np.pi]])
    fits = mean_fits(poses, points, distances, 0.1)
    np.testing.assert_allclose(fits, [(1.0 + 0.5) / 2, (0.5 + 0.2) / 2, 0.2 / 2, 0.0], rtol=1e-6)


@pytest.mark.parametrize("grid_from_base", [[6.3, 2.2, 0.4], [11.0, 6.1, -2.0]])
def test_a_scan_is_found_some_metres_from_where_it_was_searched(grid_from_base: list[float]) -> None:
    grid = rooms(MAP_FROM_GRID)
    truth = compose(MAP_FROM_GRID, grid_from_base)
    scan, matcher = alone(scan_from(grid, truth)), ExhaustiveMatcher(grid)
    best, gain = matcher.match(scan, compose(truth, [1.5, -1.0, 0.9]))
    assert np.hypot(*(best - truth)[:2]) < grid.resolution
    assert abs(wrap_angle(best[2] - truth[2])) < np.radians(1.0)
    assert gain > 0.3
    _, gain_over_best = matcher.match(scan, best)
    assert 0.0 <= gain_over_best < 0.02


def test_what_lies_behind_a_wall_does_not_fit() -> None:
    """From the left of two rooms the far wall of the right one is where the beams ended, but out of sight."""
    cells = np.full((40, 81), FREE, dtype=np.int8)
    cells[[0, -1]] = cells[:, [0, 40, 80]] = OCCUPIED
    matcher = ExhaustiveMatcher(OccupancyGrid(cells, 0.1, IDENTITY))
    scan = Scan(0, np.array([-0.01, 0.0, 0.01]), np.full(3, 6.05), np.zeros(3), IDENTITY, 30.0)
    _, gain = matcher.match(alone(scan), np.array([2.0, 2.0, 1.0]))
    assert gain < 0.2


def test_a_covered_laser_tells_nothing_of_a_stretch() -> None:
    grid, truth = rooms(), np.array([6.3, 2.2, 0.4])
    scan, matcher = scan_from(grid, truth), ExhaustiveMatcher(grid)
    covered = replace(scan, ranges=np.full(len(BEARINGS), np.inf))
    near = compose(truth, [0.5, 0.3, 0.2])
    best, gain = matcher.match(alone(scan), near)
    best_of_both, gain_of_both = matcher.match(
        ScanSegment([points_of(covered), points_of(scan)], np.zeros((2, 3))), near
    )
    np.testing.assert_allclose(best_of_both, best, atol=0.02)
    assert gain_of_both == pytest.approx(gain, abs=0.02)


def test_a_localizer_that_is_right_agrees(drive: SimulatedDrive) -> None:
    grid = rooms()
    localizer = Localizer(grid, LocalizationConfig(), np.random.default_rng(0))
    localizer.set_pose(drive.truth.map_from_base[0])
    localized = localize(drive.messages, localizer)
    comparisons = compare_scans(localized, own_trajectory(drive), ExhaustiveMatcher(grid), every=40)
    assert [each.scan for each in comparisons] == [40, 80]
    figures = recording_figures(comparisons, localized.searches)
    assert figures.scans_compared == 2
    assert figures.searches == 1
    assert figures.beyond == []
    assert 0.0 < figures.mean_m <= figures.largest_m < 0.1


def test_a_localizer_that_is_wrong_is_told(drive: SimulatedDrive) -> None:
    """Its map is the building's, moved by two metres."""
    moved = rooms(np.array([2.0, 0.0, 0.0]))
    localizer = Localizer(moved, LocalizationConfig(), np.random.default_rng(0))
    localizer.set_pose(drive.truth.map_from_base[0] + [2.0, 0.0, 0.0])
    localized = localize(drive.messages, localizer)
    comparisons = compare_scans(localized, own_trajectory(drive), ExhaustiveMatcher(rooms()), every=41)
    assert len(comparisons) == 1
    assert all(1.9 < each.metres < 2.1 and each.gain > 0.2 for each in comparisons)


def test_the_motion_during_a_sweep_is_undone() -> None:
    settings = SimulationConfig(
        duration=1.5, seed=3, start=(3.0, 4.0, 0.3), max_speed=5.0, noise=NoiseLevel.NONE
    )
    drive = simulate_drive(rooms(), settings)
    localized = LocalizedScans(
        [m for m in drive.messages if isinstance(m, Scan)], drive.truth.map_from_base, 0
    )
    last = len(localized.scans) - 2

    def error(scan: EndPoints) -> float:
        x, y = (scan.in_base - scan.laser).T
        map_from_laser = compose(drive.truth.map_from_base[last], [*scan.laser, 0.0])
        ranges = cast_ray_fan(rooms(), map_from_laser[None], np.arctan2(y, x), 30.0)[0]
        return float(np.median(np.abs(ranges - np.hypot(x, y))))

    undone = localized.segment_about(last, own_trajectory(drive), 0).scans[0]
    assert error(undone) < 0.5 * error(points_of(localized.scans[last]))


def test_the_scans_about_one_tell_where_it_is_though_it_looks_like_elsewhere(drive: SimulatedDrive) -> None:
    wrong = compose(drive.truth.map_from_base, [0.3, 0.2, 0.0])
    scans = [message for message in drive.messages if isinstance(message, Scan)]
    scans[40] = replace(scans[0], stamp=scans[40].stamp)
    localized = LocalizedScans(scans, wrong, searches=0)
    matcher = ExhaustiveMatcher(rooms())
    alone_at, _ = matcher.match(alone(scans[40]), wrong[40])
    assert np.hypot(*(alone_at - drive.truth.map_from_base[40])[:2]) > 0.5
    place, _ = matcher.match(localized.segment_about(40, own_trajectory(drive), 40), wrong[40])
    assert np.hypot(*(place - drive.truth.map_from_base[40])[:2]) < 0.1
    wrong[40] = alone_at
    (comparison,) = compare_scans(localized, own_trajectory(drive), matcher, every=41)
    assert comparison.metres > 0.5


def test_the_match_counts_that_the_others_agree_with(drive: SimulatedDrive) -> None:
    scans = [message for message in drive.messages if isinstance(message, Scan)]
    localized = LocalizedScans(scans, drive.truth.map_from_base, searches=0)
    offs = [0.1, 1.5, 0.12, 3.0, 0.05]

    class Matcher:
        def match(self, segment: ScanSegment, map_from_here: Pose) -> tuple[Pose, float]:
            off = offs.pop()
            return compose(map_from_here, [off, 0.0, 0.0]), off / 10

    (comparison,) = compare_scans(localized, own_trajectory(drive), Matcher(), every=41)  # type: ignore
    assert comparison.metres == pytest.approx(0.12)
    assert comparison.gain == pytest.approx(0.012)
    assert comparison.agrees


def test_a_stretch_lies_as_the_scans_were_taken(drive: SimulatedDrive) -> None:
    scans = [message for message in drive.messages if isinstance(message, Scan)]
    localized = LocalizedScans(scans, drive.truth.map_from_base, searches=0)
    own = own_trajectory(drive)
    segment = localized.segment_about(30, own, 160)
    expected = [select_points(scan, len(scan.bearings), own.poses_at) for scan in scans[6::8]]
    for points, wanted in zip(segment.scans, expected, strict=True):
        np.testing.assert_array_equal(points.in_base, wanted.in_base)
    np.testing.assert_allclose(
        segment.here_from_base,
        between(drive.truth.map_from_base[30], drive.truth.map_from_base[6::8]),
        atol=1e-9,
    )
    np.testing.assert_allclose(segment.here_from_base[3], IDENTITY, atol=1e-9)
    first = transform_points(segment.here_from_base[0], expected[0].in_base)
    np.testing.assert_allclose(segment.end_points()[: len(first)], first)


def test_scans_are_sorted_by_how_far_the_matches_are() -> None:
    agreeing, beyond = (
        [ScanComparison(50, 0.02, 0.0), ScanComparison(100, 0.1, 0.3)],
        ScanComparison(150, 0.2, 0.05),
    )
    figures = recording_figures([*agreeing, beyond], searches=2)
    assert figures.scans_compared == 3
    assert figures.mean_m == pytest.approx(0.06)
    assert figures.largest_m == 0.1
    assert figures.beyond == [beyond]
    assert figures.scans_beyond == 1
    assert np.isnan(recording_figures([beyond], searches=1).mean_m)


def test_only_recordings_that_exist_are_measured(tmp_path: Path) -> None:
    assert find_recordings(tmp_path) == {}
    home = tmp_path / "racecar"
    (home / "session_A").mkdir(parents=True)
    assert list(find_recordings(tmp_path)) == ["session_A on our own map"]
    (home / "maps").mkdir()
    (home / "maps" / "stata_basement.yaml").touch()
    assert list(find_recordings(tmp_path)) == ["session_A on stata_basement", "session_A on our own map"]


@pytest.mark.slow
def test_a_recorded_drive_is_found_on_the_basement_map(recordings: Path) -> None:
    found = find_recordings(recordings)
    if "localization_bag1 on stata_basement" not in found:
        pytest.skip(f"no localization_bag1 in {recordings}")
    figures = match_recording(found["localization_bag1 on stata_basement"], Config(), seed=0)
    assert figures.scans_compared == 5
    assert figures.searches == 1
    assert all(each.metres < 0.3 for each in figures.beyond)
    assert figures.largest_m <= 0.15
