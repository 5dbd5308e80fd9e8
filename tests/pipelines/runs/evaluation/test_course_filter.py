"""The reference filter follows the course's specification and finds the car."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.experiments.circle_drive import CircleDrive
from racecar.pipelines.experiments.filters import place_errors, track
from racecar.pipelines.runs.evaluation.course_filter import (
    CourseFilter,
    CourseSettings,
    mixture_parts,
    sensor_table,
)
from racecar.sensors.odometry import Odometry


def test_every_column_of_the_table_is_a_distribution() -> None:
    table = sensor_table()
    assert table.shape == (201, 201)
    assert np.all(table > 0)
    np.testing.assert_allclose(table.sum(axis=0), 1.0)


def by_the_formulas(z: int, d: int) -> float:
    """The course's unnormalized mixture, term by term."""
    gaussian = [np.exp(-((k - d) ** 2) / (2 * 8.0**2)) / np.sqrt(2 * np.pi * 8.0**2) for k in range(201)]
    hit = gaussian[z] / sum(gaussian)
    short = 2 / d * (1 - z / d) if d != 0 and 0 <= z <= d else 0.0
    return 0.74 * hit + 0.07 * short + 0.07 * (z == 200) + 0.12 / 200


@pytest.mark.parametrize("d", [0, 1, 7, 100, 199, 200])
def test_columns_follow_the_course(d: int) -> None:
    column = np.array([by_the_formulas(z, d) for z in range(201)])
    np.testing.assert_allclose(sensor_table()[:, d], column / column.sum(), rtol=1e-12)


def test_parts_of_the_table_are_as_specified() -> None:
    parts = mixture_parts(100)
    assert parts["hit"].sum() == pytest.approx(0.74)
    assert parts["hit"][92] / parts["hit"][100] == pytest.approx(np.exp(-0.5))
    assert parts["short"][0] == pytest.approx(0.07 * 2 / 100)
    assert parts["short"][50] == pytest.approx(0.07 / 100)
    assert parts["short"][101] == 0.0
    assert parts["maximum"][200] == pytest.approx(0.07)
    assert parts["maximum"][:200].sum() == 0.0
    np.testing.assert_allclose(parts["random"], 0.12 / 200)
    assert mixture_parts(0)["short"].sum() == 0.0


def test_follows_a_car_from_a_wide_start() -> None:
    drive = CircleDrive(4.0)
    rng = np.random.default_rng(1)
    filter_ = CourseFilter(drive.grid, CourseSettings(), rng)
    filter_.set_pose(np.array([0.2, -0.2, 0.1]), np.diag([0.25, 0.25, 0.06]))
    run = track(filter_, drive.messages(rng))
    assert len(run.stamps) == 80
    assert place_errors(run.map_from_base, drive.truth.map_from_base)[20:].max() < 0.15


def test_odometry_between_scans_adds_up() -> None:
    """The MIT filter loses all but the last message."""
    drive = CircleDrive(0.1)
    filter_ = CourseFilter(drive.grid, CourseSettings(noise=1e-6), np.random.default_rng(0))
    filter_.set_pose(IDENTITY, np.diag([1e-12] * 3))
    for stamp, x in enumerate([0.0, 0.1, 0.3, 0.35]):
        filter_.add_odometry(Odometry(stamp, np.array([x, 0.0, 0.0]), IDENTITY))
    scan = next(message for message in drive.messages(np.random.default_rng(0)) if hasattr(message, "ranges"))
    np.testing.assert_allclose(filter_.add_scan(scan).map_from_base, [0.35, 0.0, 0.0], atol=1e-4)


def test_headings_are_averaged_on_the_circle() -> None:
    drive = CircleDrive(0.1)
    filter_ = CourseFilter(drive.grid, CourseSettings(noise=0.05), np.random.default_rng(0))
    filter_.set_pose(np.array([0.0, 0.0, np.pi]), np.diag([1e-6, 1e-6, 0.01]))
    scan = next(message for message in drive.messages(np.random.default_rng(0)) if hasattr(message, "ranges"))
    assert abs(filter_.add_scan(scan).map_from_base[2]) > 2.5
