"""A mapper that goes round and round trims what it has seen before, and loses nothing by it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.mapping import schedule
from racecar.mapping.config import MappingConfig
from racecar.mapping.keyframes.refinement import refine_scans
from racecar.mapping.mapper import Mapper
from racecar.mapping.state import scan_poses, trimming
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import feed
from tests.sensors.drives import drive, room

KEYFRAMES, DELAY, EVERY, SCANS = 60, 50, 25, 60


@dataclass(eq=False)
class Laps:
    """A drive round and round a room, and what its mapper had kept each time that it was packed."""

    messages: list[Scan | Odometry]
    truth: Pose
    """(scans, 3)"""
    result: MappingResult
    keyframes: list[int] = field(default_factory=list)
    kept: list[int] = field(default_factory=list)
    sizes: list[tuple[int, int, int]] = field(default_factory=list)
    """Points of keyframes, of rays, and of scans between them."""


@contextmanager
def trimmed_early(keyframes: int = KEYFRAMES, scans: int = SCANS, every: int = EVERY) -> Iterator[None]:
    """So that a short drive is trimmed already."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trimming, "_KEYFRAMES", keyframes)
        patch.setattr(trimming, "_SCANS", scans)
        patch.setattr(trimming, "_DELAY", DELAY)
        patch.setattr(schedule, "PACKING_INTERVAL", every)
        yield


@pytest.fixture(scope="module", autouse=True)
def _trimmed_early() -> Iterator[None]:
    with trimmed_early():
        yield


@pytest.fixture(scope="module")
def laps(_trimmed_early: None) -> Laps:
    driven = drive(room(), 72.0, np.random.default_rng(0), speed=1.5, range_noise=0.005, odometry_scale=1.0)
    scans = [message for message in driven.messages if isinstance(message, Scan)]
    left_out = set(map(id, scans[1::2]))
    messages = [message for message in driven.messages if id(message) not in left_out]
    mapper = Mapper(MappingConfig())
    laps = Laps(messages, driven.truth[::2], None)  # type: ignore[arg-type]
    for keyframes in packings(mapper, messages):
        session, clouds = mapper.session(), mapper._state.drive.clouds.values()
        arrays = session.to_arrays()
        laps.keyframes.append(keyframes)
        laps.kept.append(int(session.keyframes.is_kept.sum()))
        laps.sizes.append((len(arrays["scans.points"]), len(arrays["rays.ends"]), sum(map(len, clouds))))
    laps.result = mapper.finish()
    return laps


def packings(mapper: Mapper, messages: list[Scan | Odometry]) -> Iterator[int]:
    """Feed all messages; yields how many keyframes there are each time that the mapper packs."""
    packed = 1
    for message in messages:
        feed(mapper, [message])
        keyframes = mapper.growth.keyframes
        if keyframes > packed and keyframes % EVERY == 1:
            packed = keyframes
            yield keyframes


def test_what_is_kept_does_not_grow_with_the_laps(laps: Laps) -> None:
    assert laps.keyframes[-1] > 3 * KEYFRAMES + DELAY + EVERY
    assert max(laps.kept) < KEYFRAMES + DELAY + EVERY
    assert laps.result.counts["keyframes_kept"] == laps.result.session.keyframes.is_kept.sum()
    half = laps.sizes[len(laps.sizes) // 2]
    assert all(last < 1.02 * earlier for last, earlier in zip(laps.sizes[-1], half, strict=True))


def test_the_scans_that_were_trimmed_are_where_they_should_be(laps: Laps) -> None:
    true = laps.truth
    found = laps.result.trajectory.map_from_base
    assert len(found) == len(true)
    seen_from = 10  # the first scans were taken on the move, with no odometry before them
    missed = between(between(true[seen_from], true), between(found[seen_from], found))
    assert np.hypot(missed[:, 0], missed[:, 1]).max() < 0.02
    assert np.abs(missed[:, 2]).max() < np.deg2rad(0.5)


def test_scans_that_wait_for_the_end_are_not_many_and_lose_nothing_by_it(laps: Laps) -> None:
    messages = laps.messages[: 2 * len(laps.messages) // 3]
    waiting: dict[int, list[int]] = {}
    found = {}
    for most in (10**6, SCANS):
        mapper = Mapper(MappingConfig())
        with trimmed_early(keyframes=10**6, scans=most):
            waiting[most] = [len(mapper._state.drive.clouds) for _ in packings(mapper, messages)]
        found[most] = mapper.finish().trajectory.map_from_base
    growth = np.diff(waiting[10**6]).max()  # by as many keyframes as lie between two times
    latest = growth * (DELAY + EVERY) / EVERY
    assert waiting[10**6][-1] > 2 * max(SCANS, latest)
    assert max(waiting[SCANS]) <= max(SCANS, latest) + growth
    apart = np.hypot(*(found[SCANS] - found[10**6])[:, :2].T)
    assert 0.0 < apart.mean() < 0.001


def test_keyframes_are_trimmed_without_placing_all_their_scans_at_once(
    laps: Laps, monkeypatch: pytest.MonkeyPatch
) -> None:
    placed: list[int] = []

    def counted(points: list[NDArray[np.float32]], *rest: Any) -> Pose:
        placed.append(len(points))
        return refine_scans(points, *rest)

    monkeypatch.setattr(scan_poses, "refine_scans", counted)
    mapper = Mapper(MappingConfig())
    with trimmed_early(scans=10**6, every=2 * EVERY):
        feed(mapper, laps.messages)
    scans = sum(isinstance(message, Scan) for message in laps.messages)
    each = scans / len(mapper.session().rays)
    assert sum(placed) > 0.25 * scans
    assert max(placed[1:]) < 1.5 * each * 10
