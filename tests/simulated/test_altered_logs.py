"""Logs that nobody recorded, made of those of the benchmark: their truth is known all the same.

Driven backwards, seen in a mirror, by a laser of more noise or whose clock is slow, with three beams in ten
or some scans missing or with a driver of the wheels that is started anew now and then, each must still be
mapped better than Cartographer mapped the true one. Without wheels, which Cartographer had, it may be half as
good.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.slam.logs import find_logs
from benchmarks.slam.slam import PUBLISHED
from racecar.maps.geometry.se2 import compose
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.runs.evaluation.relations import Relations, load_relations, relation_errors
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import mapped, scans_of

pytestmark = pytest.mark.slow

Log: TypeAlias = tuple[list[Scan | Odometry], Relations]

MIRROR = np.array([1.0, -1.0, -1.0])
MILLISECOND = 1_000_000


def as_recorded(messages: list[Scan | Odometry], relations: Relations) -> Log:
    return messages, relations


def mirrored(messages: list[Scan | Odometry], relations: Relations) -> Log:
    def mirror(message: Scan | Odometry) -> Scan | Odometry:
        if isinstance(message, Odometry):
            return replace(message, odom_from_base=MIRROR * message.odom_from_base)
        return replace(
            message,
            bearings=-message.bearings[::-1],
            ranges=message.ranges[::-1],
            time_offsets=message.time_offsets[::-1],
            base_from_laser=MIRROR * message.base_from_laser,
        )

    turned = replace(relations, first_from_second=MIRROR * relations.first_from_second)
    return [mirror(message) for message in messages], turned


def backwards(messages: list[Scan | Odometry], relations: Relations) -> Log:
    end = messages[-1].stamp
    turned = [replace(message, stamp=end - message.stamp) for message in messages]
    turned.sort(key=lambda message: (message.stamp, isinstance(message, Scan)))
    return turned, replace(relations, stamps=end - relations.stamps)


def with_beams_missing(messages: list[Scan | Odometry], relations: Relations) -> Log:
    rng = np.random.default_rng(0)
    return with_ranges(
        messages, lambda ranges: np.where(rng.random(len(ranges)) < 0.3, np.nan, ranges)
    ), relations


def with_noise(messages: list[Scan | Odometry], relations: Relations) -> Log:
    rng = np.random.default_rng(0)
    return with_ranges(messages, lambda ranges: ranges + rng.normal(0.0, 0.03, len(ranges))), relations


def with_noise_of_the_range_and_scans_missing(messages: list[Scan | Odometry], relations: Relations) -> Log:
    """Of a cheap laser: one per cent. Relations to missing scans are not asked for."""
    rng = np.random.default_rng(0)
    noisy = with_ranges(messages, lambda ranges: ranges * (1.0 + rng.normal(0.0, 0.01, len(ranges))))
    rng = np.random.default_rng(0)
    kept = [message for message in noisy if isinstance(message, Odometry) or rng.random() >= 0.06]
    stamps = np.array([message.stamp for message in kept if isinstance(message, Scan)])
    nearest = stamps[np.searchsorted(stamps, relations.stamps + MILLISECOND) - 1]
    is_asked = (np.abs(nearest - relations.stamps) < MILLISECOND).all(axis=1)
    return kept, Relations(relations.stamps[is_asked], relations.first_from_second[is_asked])


def with_ranges(
    messages: list[Scan | Odometry], alter: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> list[Scan | Odometry]:
    return [
        replace(message, ranges=alter(message.ranges)) if isinstance(message, Scan) else message
        for message in messages
    ]


def with_wheels_started_anew(messages: list[Scan | Odometry], relations: Relations) -> Log:
    rng, origin = np.random.default_rng(0), np.zeros(3)
    altered: list[Scan | Odometry] = []
    for message in messages:
        if isinstance(message, Odometry):
            if rng.random() < 0.004:
                origin = rng.uniform(-8.0, 8.0, 3) * [1.0, 1.0, 0.4]
            message = replace(message, odom_from_base=compose(origin, message.odom_from_base))
        altered.append(message)
    return altered, relations


def with_scans_stamped_late(messages: list[Scan | Odometry], relations: Relations) -> Log:
    late = 150_000_000
    altered = [
        replace(message, stamp=message.stamp + late) if isinstance(message, Scan) else message
        for message in messages
    ]
    altered.sort(key=lambda message: (message.stamp, isinstance(message, Scan)))
    return altered, replace(relations, stamps=relations.stamps + late)


@pytest.mark.parametrize("name", ["aces", "intel"])
@pytest.mark.parametrize(
    "alter",
    [
        mirrored,
        backwards,
        with_noise,
        with_beams_missing,
        with_noise_of_the_range_and_scans_missing,
        with_wheels_started_anew,
        with_scans_stamped_late,
    ],
)
def test_altered_logs_are_mapped_as_well(
    name: str, alter: Callable[[list[Scan | Odometry], Relations], Log], recordings: Path
) -> None:
    accuracy = accuracy_of_map(*alter(*read(name, recordings)))
    assert accuracy["lost"] == 0
    assert accuracy["translation_mean_m"] < PUBLISHED[name].cartographer_translation_m
    assert accuracy["rotation_mean_deg"] < PUBLISHED[name].cartographer_rotation_deg


@pytest.mark.parametrize("name", ["aces", "fr079", "intel"])
@pytest.mark.parametrize("alter", [as_recorded, mirrored])
def test_logs_without_wheels_are_not_lost(
    name: str, alter: Callable[[list[Scan | Odometry], Relations], Log], recordings: Path
) -> None:
    messages, relations = alter(*read(name, recordings))
    accuracy = accuracy_of_map(scans_of(messages), relations)
    assert accuracy["lost"] == 0
    assert accuracy["translation_mean_m"] < 2.0 * PUBLISHED[name].cartographer_translation_m
    assert accuracy["rotation_mean_deg"] < PUBLISHED[name].cartographer_rotation_deg


def read(name: str, recordings: Path) -> Log:
    (log,) = find_logs(recordings, [name])
    with BagReader(log.bag) as reader:
        return list(reader), load_relations(log.relations)


def accuracy_of_map(messages: Sequence[Scan | Odometry], relations: Relations) -> dict[str, float]:
    return relation_errors(mapped(messages).trajectory, relations).summary()
