"""What moves along with the laser is left out, and nothing else."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.sensors.cloud import Cloud
from racecar.sensors.fixed_returns.fixed_returns import FixedReturns
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import (
    STEP,
    Laser,
    odometry_of,
    scans_of,
    straight_drive,
)
from tests.sensors.worlds import CORRIDOR

SECONDS = 25.0


def round_drive() -> Pose:
    """(N, 3) poses every `STEP`, round the middle of the room at half a metre a second, swaying."""
    angle = np.arange(0.0, SECONDS + 2.0, STEP) / 3.0
    yaw = angle + np.pi / 2.0 + 0.3 * np.sin(5.0 * angle)
    return np.column_stack([1.5 * np.cos(angle), 1.5 * np.sin(angle), yaw])


DRIVE = round_drive()
STANDING = np.zeros_like(DRIVE)
QUICK = Laser(sweep=0.02)


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    """Of a drive through a room."""
    return scans_of(DRIVE, SECONDS, QUICK)


def measured(scans: list[Scan], drive: Pose) -> list[Measurement]:
    """In the order of time, with the odometry of a drive."""
    return sorted([*odometry_of(drive, SECONDS), *scans], key=lambda each: each.stamp)


def with_thing(scans: list[Scan], is_seen: np.ndarray, metres: float) -> list[Scan]:
    """Before all beams that see it (N,) a thing moves along, so many metres away."""
    rng = np.random.default_rng(3)
    return [
        replace(
            scan,
            ranges=np.where(
                is_seen, np.minimum(scan.ranges, metres + rng.normal(0.0, 0.01, len(is_seen))), scan.ranges
            ),
        )
        for scan in scans
    ]


def left_out(messages: list[Measurement]) -> list[np.ndarray]:
    """Which beams of each scan lose a return."""
    before = [message for message in messages if isinstance(message, Scan)]
    after = [m for m in FixedReturns().filtered(messages) if isinstance(m, Scan)]
    assert [scan.stamp for scan in after] == [scan.stamp for scan in before]
    return [old.is_return & ~new.is_return for old, new in zip(before, after, strict=True)]


def test_a_drive_through_a_room_comes_back_as_it_was(scans: list[Scan]) -> None:
    messages = measured(scans, DRIVE)
    fixed_returns = FixedReturns()
    result = list(fixed_returns.filtered(messages))
    assert len(result) == len(messages)
    assert all(given is taken for given, taken in zip(result, messages, strict=True))
    assert fixed_returns.left_out.returns == 0


@pytest.mark.parametrize("wheels", [DRIVE, STANDING, None])
def test_who_carries_the_robot_is_left_out_whether_the_wheels_know_of_it_or_not(
    scans: list[Scan], wheels: Pose | None
) -> None:
    is_body = np.abs(scans[0].bearings) > np.pi / 2.0
    carried = with_thing(scans, is_body, 0.3)
    masks = left_out(list(carried) if wheels is None else measured(carried, wheels))
    assert np.mean([mask[is_body].mean() for mask in masks]) > 0.95
    assert np.mean([mask[~is_body].mean() for mask in masks]) < 0.01


def test_the_floor_is_left_out_where_it_hides_the_walls() -> None:
    drive = straight_drive(SECONDS)
    scans = scans_of(drive, SECONDS, QUICK)
    floor = 2.0 / np.maximum(np.cos(scans[0].bearings), 1e-6)
    is_seen = floor < 3.0
    on_floor = [
        replace(scan, ranges=np.where(is_seen, np.minimum(scan.ranges, floor), scan.ranges)) for scan in scans
    ]
    masks = left_out(measured(on_floor, drive))
    hidden = [old.ranges > floor + 0.3 for old in scans]
    assert (
        np.mean(
            [
                mask[is_seen & far].mean()
                for mask, far in zip(masks, hidden, strict=True)
                if far[is_seen].any()
            ]
        )
        > 0.7
    )
    assert np.mean([mask[~is_seen].mean() for mask in masks]) < 0.01


def test_wheels_that_spin_leave_all_returns_in() -> None:
    standing = scans_of(STANDING, SECONDS, QUICK)
    assert not any(mask.any() for mask in left_out(measured(standing, straight_drive(SECONDS))))


def test_the_walls_of_a_corridor_stay() -> None:
    drive = straight_drive(SECONDS)
    scans = scans_of(drive, SECONDS, QUICK, CORRIDOR)
    assert not any(mask.any() for mask in left_out(measured(scans, drive)))


def test_a_post_that_misleads_nobody_stays(scans: list[Scan]) -> None:
    is_post = np.abs(scans[0].bearings - 1.0) < 0.1
    assert not any(mask.any() for mask in left_out(measured(with_thing(scans, is_post, 0.3), DRIVE)))


def test_many_posts_are_left_out_although_they_hide_each_other(scans: list[Scan]) -> None:
    is_post = np.sin(12.0 * scans[0].bearings) > 0.5
    masks = left_out(measured(with_thing(scans, is_post, 0.3), DRIVE))
    assert np.mean([mask[is_post].mean() for mask in masks]) > 0.5
    assert np.mean([mask[~is_post].mean() for mask in masks]) < 0.01


def test_it_is_told_where_and_when(scans: list[Scan]) -> None:
    is_body = np.abs(scans[0].bearings) < 0.999 * np.pi / 4.0
    carried = with_thing(scans, is_body, 0.32)
    fixed_returns = FixedReturns()
    list(fixed_returns.filtered(measured([*scans[:80], *carried[80:]], DRIVE)))  # from the second block on
    told = fixed_returns.left_out
    begin, end = told.seconds
    assert begin == pytest.approx(10.0, abs=1.0)
    assert end == pytest.approx(SECONDS, abs=0.5)
    (sector,) = told.sectors
    assert (sector.begin, sector.end) == (-45.0, 45.0)
    assert 0.2 < sector.nearest < 0.32 < sector.farthest < 0.5
    assert told.share == pytest.approx(0.25, abs=0.03)


def test_clouds_are_not_held(scans: list[Scan]) -> None:
    given = 0

    def clouds() -> Iterator[Measurement]:
        nonlocal given
        cloud = Cloud(np.zeros((1, 3), dtype=np.float32), np.zeros(1, dtype=np.float32))
        for scan in scans:
            given += 1
            yield Odometry(scan.stamp, IDENTITY, IDENTITY)
            yield replace(scan, cloud=cloud)

    held = [given - taken // 2 for taken, _ in enumerate(FixedReturns().filtered(clouds()))]
    assert max(held) <= 4
