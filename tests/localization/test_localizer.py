import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, between, compose, transform_points, wrap_angle
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import BASE_FROM_LASER, BEARINGS, GO_ON, Drive, drive, room

SECOND = 1_000_000_000


def localizer(seed: int = 0, **options: float) -> Localizer:
    return Localizer(room(), LocalizationConfig.model_validate(options), np.random.default_rng(seed))


def replay(filter: Localizer, messages: list[Scan | Odometry]) -> list[PoseEstimate]:
    estimates = []
    for message in messages:
        if isinstance(message, Scan):
            estimates.append(filter.add_scan(message))
        else:
            filter.add_odometry(message)
    return estimates


def errors(estimates: list[PoseEstimate], driven: Drive) -> tuple[np.ndarray, np.ndarray]:
    """(N,) metres and radians."""
    difference = np.array([estimate.map_from_base for estimate in estimates]) - driven.truth
    return np.hypot(difference[:, 0], difference[:, 1]), np.abs(wrap_angle(difference[:, 2]))


@dataclass(frozen=True, eq=False)
class Tracked:
    filter: Localizer
    estimates: list[PoseEstimate]
    metres: np.ndarray
    radians: np.ndarray


def tracked(
    driven: Drive, messages: list[Scan | Odometry] | None = None, off: tuple[float, float, float] = (0, 0, 0)
) -> Tracked:
    """A drive, or what its sensors said instead, followed from a pose as far off its beginning."""
    filter = localizer()
    filter.set_pose(driven.truth[0] + np.array(off))
    estimates = replay(filter, driven.messages if messages is None else messages)
    return Tracked(filter, estimates, *errors(estimates, driven))


def altered(
    driven: Drive,
    scan: Callable[[Scan], Scan] = lambda each: each,
    odometry: Callable[[Odometry], Odometry] = lambda each: each,
) -> list[Scan | Odometry]:
    return [scan(each) if isinstance(each, Scan) else odometry(each) for each in driven.messages]


@cache
def four_seconds() -> Drive:
    return drive(room(), 4.0, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("speed", "odometry_scale"), [(0.5, 1.03), (3.0, 1.03), (3.0, 0.75), (6.0, 1.03), (6.0, 1.25)]
)
def test_tracks_from_a_rough_start(speed: float, odometry_scale: float) -> None:
    driven = drive(room(), 4.0, np.random.default_rng(0), speed=speed, odometry_scale=odometry_scale)
    result = tracked(driven, off=(0.4, -0.3, 0.15))
    assert result.metres.mean() < 0.05
    assert np.rad2deg(result.radians).mean() < 1.0
    assert result.metres.max() < 0.2


def test_is_not_lost_where_the_odometry_begins_anew() -> None:
    driven = drive(room(), 4.0, np.random.default_rng(0), speed=2.0, odometry_scale=1.03)
    origins = np.random.default_rng(1).uniform(-3.0, 3.0, (9, 3))

    def moved(each: Odometry) -> Odometry:
        return replace(each, odom_from_base=compose(origins[2 * each.stamp // SECOND], each.odom_from_base))

    metres = tracked(driven, altered(driven, odometry=moved)).metres
    assert metres.mean() < 0.05
    assert metres.max() < 0.2


@pytest.mark.parametrize("speed", [0.7, 2.0, 4.0])
def test_odometry_that_hangs_is_left_out_while_the_car_drives(speed: float) -> None:
    driven = drive(room(), 5.0, np.random.default_rng(0), speed=speed, odometry_scale=1.03)
    begin, end = 3 * SECOND // 2, 4 * SECOND
    held = [m for m in driven.messages if isinstance(m, Odometry) and m.stamp <= begin][-1].odom_from_base

    def hung(each: Odometry) -> Odometry:
        return replace(each, odom_from_base=held) if begin < each.stamp < end else each

    result = tracked(driven, altered(driven, odometry=hung))
    assert np.median(result.metres[30:80]) < 0.06
    assert result.metres[50:].max() < 0.15
    assert "1.5 to 4.0 s" in str(result.filter.frozen_odometry.warning(0))


def test_a_car_that_stands_keeps_its_place_and_does_not_become_surer_of_it() -> None:
    """Its odometry does not hang, and its scans repeat the first ones."""
    result = tracked(drive(room(), 20.0, np.random.default_rng(0), speed=0.0))
    assert result.metres[:60].max() < 0.05
    assert not result.filter.frozen_odometry.is_frozen_at(2 * SECOND)
    deviations = np.array([estimate.deviation for estimate in result.estimates])
    assert deviations[-100:].mean() > 0.96 * deviations[100:200].mean()


def among_pillars(columns: NDArray[np.int64]) -> OccupancyGrid:
    """The room with nothing in it but pillars of 0.4 m, each so many cells along it."""
    grid = room()
    cells = np.full_like(grid.cells, FREE)
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    for row, column in zip(np.random.default_rng(107).integers(10, 140, 14), columns, strict=True):
        cells[row : row + 8, column : column + 8] = OCCUPIED
    return replace(grid, cells=cells)


def test_a_told_place_stays_in_mind_where_a_first_scan_fits_better_beside_it() -> None:
    columns = np.random.default_rng(7).integers(10, 208, 14)
    moved_by_a_metre = columns + 20 * (np.arange(14) < 11)
    driven = drive(among_pillars(moved_by_a_metre), 0.1, np.random.default_rng(0))
    filter = Localizer(among_pillars(columns), LocalizationConfig(), np.random.default_rng(0))
    filter.set_pose(driven.truth[0])
    replay(filter, driven.messages)
    off = np.hypot(*(filter.particles()[0] - driven.truth[0])[:, :2].T)
    assert np.mean(off < 0.3) > 0.5
    assert np.mean(off > 0.7) > 0.02


@pytest.mark.parametrize("seed", range(4))
def test_finds_itself_anywhere(seed: int) -> None:
    driven = drive(room(), 2.0, np.random.default_rng(seed))
    metres, radians = errors(replay(localizer(seed), driven.messages), driven)
    assert metres[10:].max() < 0.1
    assert np.rad2deg(radians[10:]).max() < 2.0


def test_runs_without_odometry() -> None:
    """Where each beam was is known by the speed of the estimates; without that it would be 0.034 m."""
    scans = [message for message in four_seconds().messages if isinstance(message, Scan)]
    assert tracked(four_seconds(), scans).metres.mean() < 0.025


def test_same_seed_same_bits() -> None:
    driven = drive(room(), 1.0, np.random.default_rng(0))
    runs = [replay(localizer(seed), driven.messages) for seed in (7, 7, 8)]
    poses = [np.array([estimate.map_from_base for estimate in run]) for run in runs]
    assert poses[0].tobytes() == poses[1].tobytes()
    assert poses[0].tobytes() != poses[2].tobytes()


def test_found_again_after_being_carried_during_a_gap() -> None:
    """It starts anew where it was, and then where it is found."""
    driven, filter = four_seconds(), localizer()
    filter.set_pose(driven.truth[0])
    cut = [m for m in driven.messages if m.stamp < SECOND or (isinstance(m, Scan) and m.stamp > 3.2 * SECOND)]
    estimates = replay(filter, cut)
    assert np.hypot(*(estimates[-1].map_from_base - driven.truth[-1])[:2]) < 0.1
    assert sum(estimate.is_start for estimate in estimates) == 3


def twin_rooms() -> OccupancyGrid:
    """Two rooms of 6 x 4 m, the same but for their place, with no door between."""
    room = np.full((80, 120), FREE, dtype=np.int8)
    room[:3], room[-3:], room[:, :3], room[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    room[3:20, 70:80] = OCCUPIED
    room[60:, 20:26] = OCCUPIED
    return OccupancyGrid(np.hstack([room, room]), 0.05, IDENTITY)


@pytest.mark.parametrize("seed", range(3))
def test_after_a_gap_the_near_place_wins_over_a_far_one_that_fits_better(seed: int) -> None:
    """Since the map was made something was put before the car; on the map its like is in the other room."""
    mapped, real = twin_rooms(), twin_rooms()
    mapped.cells[35:45, 200:204] = OCCUPIED
    real.cells[35:45, 80:84] = OCCUPIED
    filter = Localizer(mapped, LocalizationConfig(), np.random.default_rng(seed))
    truth = np.array([2.0, 2.0, 0.0])
    filter.set_pose(truth)
    ranges = cast_ray_fan(real, compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    for stamp in (0, SECOND // 20, 60 * SECOND, 61 * SECOND):
        filter.add_odometry(Odometry(stamp, IDENTITY, IDENTITY))
        estimate = filter.add_scan(scan(stamp, ranges))
    assert np.hypot(*(estimate.map_from_base - truth)[:2]) < 0.2


@pytest.mark.parametrize("with_odometry", [True, False])
def test_after_a_gap_a_far_place_is_found_where_no_near_one_fits(with_odometry: bool) -> None:
    """The car was carried across the room; its wheels, if they tell anything, did not turn.

    The next scan confirms what the first finds; until then the car is not claimed to be where it was.
    """
    grid, filter, lost = room(), localizer(), []
    there = [(60 * SECOND + scan * SECOND // 20, [3.0, 3.0, 1.0]) for scan in range(2)]
    for stamp, place in [(0, [9.0, 2.0, 0.0]), *there]:
        truth = compose(grid.map_from_grid, place)
        if stamp == 0:
            filter.set_pose(truth)
        if with_odometry:
            filter.add_odometry(Odometry(stamp, IDENTITY, IDENTITY))
        ranges = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
        estimate = filter.add_scan(scan(stamp, ranges))
        lost.append(estimate.lost_probability)
    assert np.hypot(*(estimate.map_from_base - truth)[:2]) < 0.1
    assert lost[1] > 0.9
    assert lost[2] < 0.1


def test_notices_that_scans_no_longer_fit() -> None:
    driven = four_seconds()
    wrong = compose(driven.truth[0], [-2.5, 0.5, 2.5]) - driven.truth[0]
    assert tracked(driven, off=wrong).metres[-1] < 0.1


@pytest.mark.parametrize("pose", [(np.nan, 0.0, 0.0), (np.inf, 0.0, 0.0), (1e3, 1e3, 0.0), (1e300, 0.0, 0.0)])
def test_impossible_start_is_a_sentence(pose: tuple[float, float, float]) -> None:
    with pytest.raises(UserError, match="initial pose"):
        localizer().set_pose(np.array(pose))


@pytest.mark.parametrize("covariance", [np.full((3, 3), np.nan), -np.eye(3), np.eye(2)])
def test_an_impossible_covariance_is_a_sentence(covariance: np.ndarray) -> None:
    with pytest.raises(UserError, match="covariance"):
        localizer().set_pose(compose(room().map_from_grid, [9.0, 4.0, 0.7]), covariance)


def test_the_start_is_spread_by_its_covariance() -> None:
    filter = localizer()
    start = compose(room().map_from_grid, [9.0, 4.0, 0.7])
    covariance = np.array([[0.04, 0.015, 0.0], [0.015, 0.01, 0.0], [0.0, 0.0, 0.0009]])
    filter.set_pose(start, covariance)
    poses, weights = filter.particles()
    np.testing.assert_allclose(np.cov(poses.T), covariance, atol=4e-3)
    assert np.isclose(weights.sum(), 1.0)


@pytest.mark.parametrize(
    ("point", "radius"), [((np.nan, 0.0), 1.0), ((1e3, 0.0), 1.0), ((0.0, 0.0), 0.0), ((0.0, 0.0), np.inf)]
)
def test_an_impossible_position_is_a_sentence(point: tuple[float, float], radius: float) -> None:
    with pytest.raises(UserError, match=r"position|free space"):
        localizer().set_position(np.array(point), radius)


@pytest.mark.parametrize("scale", [0.92, 1.08])
def test_by_what_factor_odometry_is_off_is_learned(scale: float) -> None:
    driven = drive(room(), 10.0, np.random.default_rng(0), speed=2.0, odometry_scale=scale)
    result = tracked(driven)
    assert result.filter.calibration.faults.distance == pytest.approx(1.0 / scale - 1.0, abs=0.025)
    assert result.metres[-100:].max() < 0.06


@pytest.mark.parametrize("turn", [-0.05, 0.05])
def test_a_laser_that_is_turned_against_its_told_place_is_found_and_corrected(turn: float) -> None:
    driven = drive(room(), 36.0, np.random.default_rng(0), speed=2.0)

    def turned(each: Scan) -> Scan:
        return replace(each, base_from_laser=each.base_from_laser - [0.0, 0.0, turn])

    result = tracked(driven, altered(driven, scan=turned))
    assert result.filter.calibration.laser_turn == pytest.approx(turn, abs=0.015)
    assert np.median(result.radians[-20:]) < 0.015


@settings(max_examples=60)
@given(st.lists(st.integers(-400, 450), min_size=2, max_size=8))
def test_the_carried_pose_is_the_last_one_and_what_the_odometry_told_since(milliseconds: list[int]) -> None:
    """Asked as often as one likes, also past the latest odometry; the doubt grows with the way."""
    filter, last, told = carried_filter()
    doubts = []
    for ahead in milliseconds:
        carried = filter.pose_at(last.stamp + ahead * 1_000_000)
        assert carried is not None
        assert carried.stamp == last.stamp + ahead * 1_000_000
        before, after = told.pose_at([last.stamp, carried.stamp])
        step = filter.calibration.faults.corrected(between(before, after))
        expected = compose(last.map_from_base, step)
        np.testing.assert_allclose(between(expected, carried.map_from_base), 0.0, atol=1e-9)
        assert np.linalg.eigvalsh(carried.covariance).min() > 0.0
        assert carried.lost_probability == last.lost_probability
        assert not (carried.is_start and ahead)
        if ahead >= 0:
            doubts.append((ahead, np.linalg.det(carried.covariance)))
    assert np.all(np.diff([doubt for _, doubt in sorted(doubts)]) >= 0.0)


@cache
def carried_filter() -> tuple[Localizer, PoseEstimate, OdometryBuffer]:
    """One that has heard scans for a second and a half, and odometry for a little longer."""
    driven = drive(room(), 2.0, np.random.default_rng(0), speed=3.0, odometry_scale=1.0)
    heard = [m for m in driven.messages if m.stamp <= (1.7 if isinstance(m, Odometry) else 1.5) * SECOND]
    filter, told = localizer(), OdometryBuffer(extrapolation=GO_ON)
    assert filter.pose_at(0) is None
    filter.set_pose(driven.truth[0])
    estimates = replay(filter, heard)
    for message in heard:
        if isinstance(message, Odometry):
            told.add(message)
    assert np.hypot(*(estimates[-1].map_from_base - driven.truth[len(estimates) - 1])[:2]) < 0.06
    return filter, estimates[-1], told


@pytest.mark.parametrize("seed", range(2))
def test_found_from_a_position_without_a_heading(seed: int) -> None:
    driven = drive(room(), 1.5, np.random.default_rng(seed))
    filter = localizer(seed)
    point, radius = driven.truth[0, :2] + [0.3, -0.4], 1.0
    filter.set_position(point, radius)
    poses, weights = filter.particles()
    assert np.hypot(*(poses[:, :2] - point).T).max() < radius + 0.1
    assert np.histogram(poses[:, 2], bins=4, range=(-np.pi, np.pi))[0].min() > 0.2 * len(poses)
    np.testing.assert_allclose(weights, 1.0 / len(poses))
    metres, radians = errors(replay(filter, driven.messages), driven)
    assert metres[10:].max() < 0.1
    assert np.rad2deg(radians[10:]).max() < 2.0


def test_the_particles_told_are_ones_own() -> None:
    filter = localizer()
    filter.set_pose(compose(room().map_from_grid, [9.0, 4.0, 0.7]))
    poses, weights = filter.particles()
    poses[:], weights[:] = np.nan, np.nan
    again, still = filter.particles()
    assert np.all(np.isfinite(again))
    assert still.sum() == pytest.approx(1.0)
    filter.add_scan(scan(0, np.full(271, 2.0)))
    assert np.all(np.isfinite(filter.particles()[0]))


def test_recovers_from_an_odometry_that_tells_backward_as_forward() -> None:
    driven = drive(room(), 4.0, np.random.default_rng(0), odometry_scale=1.0)
    odom_from_base, before = IDENTITY, IDENTITY

    def backward(each: Odometry) -> Odometry:
        nonlocal odom_from_base, before
        step, before = between(before, each.odom_from_base), each.odom_from_base
        is_told_wrongly = 1.5 * SECOND < each.stamp < 1.8 * SECOND
        odom_from_base = compose(odom_from_base, [-step[0], 0.0, 0.0] if is_told_wrongly else step)
        return replace(each, odom_from_base=odom_from_base)

    assert tracked(driven, altered(driven, odometry=backward)).metres[-10:].max() < 0.1


def test_settings_change_while_running() -> None:
    driven = drive(room(), 2.0, np.random.default_rng(0))
    filter = localizer(fewest_particles=4000)
    filter.set_pose(driven.truth[0])
    half = len(driven.messages) // 2
    first = replay(filter, driven.messages[:half])
    filter.reconfigure(LocalizationConfig(particles=500, beams=60))
    second = replay(filter, driven.messages[half:])
    assert second[-1].particle_count == 500
    metres, _ = errors(first + second, driven)
    assert metres[len(first) :].max() < 0.1


def scan(stamp: int, ranges: np.ndarray, offsets: np.ndarray | None = None) -> Scan:
    count = len(ranges)
    offsets = np.zeros(count) if offsets is None else offsets
    return Scan(stamp, BEARINGS[:count], ranges, offsets, BASE_FROM_LASER, 30.0)


STRANGE = [
    scan(SECOND, np.full(271, np.nan)),
    scan(2 * SECOND, np.empty(0)),
    scan(3 * SECOND, np.array([2.0])),
    scan(3 * SECOND, np.full(271, np.inf)),
    scan(1, np.full(271, 3.0)),
    scan(3600 * SECOND, np.full(271, 3.0), np.full(271, np.nan)),
    scan(3601 * SECOND, np.full(271, 3.0), np.full(271, -1e6)),
    scan(-(2**40), np.full(271, -5.0)),
    scan(2 * SECOND, np.full(100, 1e9)),
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("with_odometry", [True, False])
@pytest.mark.parametrize("strange", STRANGE)
def test_lives_through_strange_input(strange: Scan, with_odometry: bool) -> None:
    driven = drive(room(), 0.5, np.random.default_rng(0))
    filter = localizer()
    strange_odometry = [
        Odometry(SECOND, np.array([np.nan, 0.0, 0.0]), IDENTITY),
        Odometry(-SECOND, np.array([1e9, 0.0, 0.0]), IDENTITY),
        Odometry(10**18, np.array([-1e9, 0.0, 9.0]), IDENTITY),
    ]
    for message in [strange, *driven.messages, strange, *strange_odometry, strange, *driven.messages]:
        if isinstance(message, Scan):
            estimate = filter.add_scan(message)
            assert np.all(np.isfinite(estimate.map_from_base))
            assert np.all(np.isfinite(estimate.covariance))
        elif with_odometry:
            filter.add_odometry(message)


def run_together(*works: Callable[[], None]) -> None:
    """Each in a thread of its own; fails as they do."""
    with ThreadPoolExecutor(len(works)) as pool:
        for running in [pool.submit(work) for work in works]:
            running.result(timeout=60)


def test_odometry_and_scans_from_two_threads() -> None:
    """However the threads interleave, no motion is lost and nothing is torn."""
    driven, filter, done = drive(room(), 3.0, np.random.default_rng(0)), localizer(), threading.Event()
    filter.set_pose(driven.truth[0])
    estimates: list[PoseEstimate] = []

    def add_odometry() -> None:
        replay(filter, [message for message in driven.messages if isinstance(message, Odometry)])

    def add_scans() -> None:
        try:
            for message in driven.messages:
                if isinstance(message, Scan):
                    estimates.append(filter.add_scan(message))
        finally:
            done.set()

    def relocate() -> None:
        while not done.wait(0.05):
            filter.set_pose(driven.truth[len(estimates) - 1 if estimates else 0])

    run_together(add_odometry, add_scans, relocate)
    metres, _ = errors(estimates, driven)
    assert np.median(metres) < 0.1


def test_readers_beside_the_scans_see_no_two_of_them_mixed() -> None:
    """All that is read belongs to one scan, to the bit, while threads change places all the time."""
    driven = drive(room(), 1.5, np.random.default_rng(0), speed=3.0)
    filter, told = localizer(fewest_particles=100), OdometryBuffer(extrapolation=GO_ON)
    filter.set_pose(driven.truth[0])
    for message in driven.messages:
        if isinstance(message, Odometry):
            filter.add_odometry(message)
            told.add(message)
    clouds, clouds_read, done = {cloud_of(filter)}, set(), threading.Event()
    estimates: list[PoseEstimate] = []
    faults: list[OdometryFaults] = []
    carried: list[PoseEstimate] = []

    def add_scans() -> None:
        try:
            for message in driven.messages:
                if isinstance(message, Scan):
                    estimates.append(filter.add_scan(message))
                    faults.append(filter.calibration.faults)
                    clouds.add(cloud_of(filter))
                    time.sleep(0.001)  # readers get a turn however busy the machine is
        finally:
            done.set()

    def read_poses() -> None:
        while not done.is_set():
            estimate = filter.pose_at(SECOND)
            if estimate is not None:
                carried.append(estimate)

    def read_particles() -> None:
        while not done.is_set():
            clouds_read.add(cloud_of(filter))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        run_together(add_scans, read_poses, read_particles)
    finally:
        sys.setswitchinterval(interval)
    assert len(estimates) == len(driven.truth)
    assert len(clouds_read) > 3
    assert clouds_read <= clouds
    odom_from_base = told.pose_at([estimate.stamp for estimate in estimates])
    steps = between(odom_from_base, told.pose_at([SECOND]))
    possible = compose(
        np.array([estimate.map_from_base for estimate in estimates]),
        np.array([each.corrected(step) for each, step in zip(faults, steps, strict=True)]),
    )
    read = np.unique([estimate.map_from_base for estimate in carried], axis=0)
    assert len(read) > 3
    assert np.abs(between(possible[:, None], read)).max(axis=2).min(axis=0).max() < 1e-9


def cloud_of(filter: Localizer) -> int:
    poses, weights = filter.particles()
    return hash((poses.tobytes(), weights.tobytes()))


@pytest.mark.parametrize("reading", [np.nan, np.inf])
def test_odometry_carries_the_pose_while_no_beam_meets_anything(reading: float) -> None:
    """A covered laser reads nothing, or misses only; these say nothing of the place."""
    driven = drive(room(), 6.0, np.random.default_rng(0), odometry_scale=1.0)

    def covered(each: Scan) -> Scan:
        is_covered = 2.0 < each.stamp * 1e-9 < 4.0
        return replace(each, ranges=np.full(len(each.ranges), reading)) if is_covered else each

    result = tracked(driven, altered(driven, scan=covered))
    assert result.metres.max() < 0.3
    assert result.metres[-40:].mean() < 0.05
    assert sum(estimate.is_start for estimate in result.estimates) == 1


def test_the_points_of_the_last_scan_are_corrected_for_its_sweep() -> None:
    driven = drive(room(), 2.0, np.random.default_rng(0), speed=6.0, range_noise=0.0)
    filter = localizer()
    filter.set_pose(driven.truth[0])
    estimates = replay(filter, driven.messages)
    scan = [message for message in driven.messages if isinstance(message, Scan)][-1]
    rows, columns = np.nonzero(room().cells == OCCUPIED)
    cells = (np.column_stack([columns, rows]) + 0.5) * room().resolution
    walls = cKDTree(transform_points(room().map_from_grid, cells))
    as_seen, corrected = (
        float(np.mean(walls.query(transform_points(estimates[-1].map_from_base, points))[0]))
        for points in (scan.points_in_base(), filter.points_in_base(scan))
    )
    assert corrected < 0.03 < as_seen
