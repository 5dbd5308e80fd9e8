from copy import copy

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.sensors.matching.scan_matching_kernels import UNIT
from racecar.sensors.matching.scan_store import MAX_POINTS, PreparedScan, ScanStore, prepare_scan


def wall(
    rng: np.random.Generator, noise: float, turn: float, beams: int = 181
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns (N, 2) of a wall two metres off, and the unit vector from it to the sensor."""
    bearings = np.deg2rad(np.linspace(-40.0, 40.0, beams))
    ranges = 2.0 / np.cos(bearings) + rng.normal(0.0, noise, beams)
    points = ranges[:, None] * np.column_stack([np.cos(bearings + turn), np.sin(bearings + turn)])
    return points, -np.array([np.cos(turn), np.sin(turn)])


@given(st.floats(-3.1, 3.1), st.floats(0.02, 0.03), st.integers(0, 2**32))
@example(turn=-3.0625, noise=0.02734375, seed=1198187)
def test_noise_is_smoothed_along_a_wall(turn: float, noise: float, seed: int) -> None:
    """Nine points in ten have a normal over several scans, not in each: where the seam behind the sensor cuts
    the wall there are four ends instead of two, at which lines have points on one side only, and of single
    scans with 3 cm of noise one in forty then has fewer (one in 300 elsewhere)."""
    rng = np.random.default_rng(seed)
    points, normal = wall(rng, noise, turn)
    scan = prepare_scan(points)
    measured, smoothed = points @ normal + 2.0, scan.points @ normal + 2.0
    assert np.sqrt(np.mean(smoothed**2)) < 0.75 * np.sqrt(np.mean(measured**2))
    scans = [scan, *(prepare_scan(wall(rng, noise, turn)[0]) for _ in range(11))]
    has_normal = [np.any(each.normals != 0.0, axis=1) for each in scans]
    assert np.mean(has_normal) > 0.9
    assert np.median(scan.normals[has_normal[0]] @ normal) > np.cos(0.2)


@given(st.floats(-3.1, 3.1), st.integers(0, 2**32))
@example(turn=-2.6296282143082417, seed=24)
def test_a_precise_scan_stays_as_it_was_measured(turn: float, seed: int) -> None:
    points, normal = wall(np.random.default_rng(seed), 0.002, turn)
    along = np.array([normal[1], -normal[0]])  # a return may move across the seam behind the sensor
    kept, measured = (each[np.argsort(each @ along)] for each in (prepare_scan(points).points, points))
    assert kept == pytest.approx(measured, abs=5e-4)


def test_a_corner_stays_a_corner() -> None:
    bearings = np.deg2rad(np.arange(-40.0, 41.0, 0.5))
    ranges = 3.0 / np.cos(np.pi / 4 - np.abs(bearings))  # two walls that meet at right angles straight ahead
    points = ranges[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    scan = prepare_scan(points)
    assert scan.points == pytest.approx(points, abs=0.01)
    at_corner = np.argmin(np.abs(bearings))
    assert np.all(scan.normals[at_corner] == 0.0)
    assert np.all(np.any(scan.normals[np.abs(bearings) > np.deg2rad(10.0)] != 0.0, axis=1))


@given(st.integers(1, 2000), st.floats(0.0, 0.1), st.integers(0, 2**32))
def test_points_ascend_in_bearing_and_are_not_too_many(beams: int, noise: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    bearings = rng.uniform(-np.pi, np.pi, beams)
    ranges = rng.uniform(0.5, 5.0) + rng.normal(0.0, noise, beams)
    scan = prepare_scan(ranges[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)]))
    assert 0 < len(scan.points) <= MAX_POINTS
    assert np.all(np.diff(np.arctan2(scan.points[:, 1], scan.points[:, 0])) >= 0.0)


def scans(count: int, rng: np.random.Generator) -> list[PreparedScan]:
    """Of up to ten points, some without any; every second point has a normal."""
    drawn = []
    for points in rng.integers(0, 11, count):
        angles = rng.uniform(-np.pi, np.pi, points)
        normals = (np.arange(points) % 2)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        drawn.append(
            PreparedScan(rng.normal(size=(points, 2)).astype(np.float32), normals.astype(np.float32))
        )
    return drawn


def holds(store: ScanStore, expected: list[PreparedScan], is_kept: NDArray[np.bool_]) -> bool:
    """Whether a store has the scans that are kept, and nothing of the others."""
    empty = PreparedScan(*np.zeros((2, 0, 2), dtype=np.float32))
    wanted = [scan if kept else empty for scan, kept in zip(expected, is_kept, strict=True)]
    points, normals, counts, _ = store.packed()
    return len(store) == len(wanted) and all(
        np.array_equal(store.points_of(k), scan.points)
        and np.array_equal(points[row, : counts[row]], scan.points)
        and np.allclose(normals[row, : counts[row]] / UNIT, scan.normals, rtol=0.0, atol=1e-4)
        and (len(scan.points) > 0) == store.is_kept[k]
        for k, (row, scan) in enumerate(zip(store.row_of, wanted, strict=True))
    )


@settings(max_examples=50)
@given(st.integers(1, 150), st.integers(0, 400), st.integers(0, 2**32))
def test_scans_are_trimmed_and_the_others_stay(before: int, after: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    expected, store = scans(before + after, rng), ScanStore(1)
    for scan in expected[:before]:
        store.add(scan)
    is_kept = rng.random(before) < 0.5
    earlier = copy(store)
    store.trim(np.flatnonzero(~is_kept))
    assert holds(store, expected[:before], is_kept)
    for scan in expected[before:]:
        store.add(scan)
    is_kept = np.append(is_kept, np.ones(after, dtype=np.bool_))
    assert holds(store, expected, is_kept)
    assert holds(earlier, expected[:before], np.ones(before, dtype=np.bool_))
    assert holds(ScanStore.from_arrays(store.to_arrays()), expected, is_kept)
    both = ScanStore()
    both.extend(store)
    both.extend(earlier)
    assert holds(both, [*expected, *expected[:before]], np.append(is_kept, np.ones(before, dtype=np.bool_)))
