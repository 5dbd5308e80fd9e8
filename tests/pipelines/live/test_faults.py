"""Both nodes live through all that goes wrong with a car's sensors, one after the other on one drive."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.pipelines.live.live_car import LiveCar
from tests.pipelines.live.stage import Stage, initial_pose, localizer_stage, mapper_stage

SECOND = 10**9
TOLD_APART = 7
"""Nanoseconds, by which the truth at stamps of scans and of odometry is told apart."""


@dataclass(frozen=True)
class Fault:
    """What goes wrong, and what is said of it."""

    begin: Callable[[LiveCar], None]
    words: str
    """In ``/diagnostics``; empty where there is nothing to say."""
    is_mended: bool
    """Whether the poses are right while it lasts."""
    seconds: float = 0.0
    """For which it lasts at least."""


def no_scans(car: LiveCar) -> None:
    car.scans_on = False


def no_odometry(car: LiveCar) -> None:
    car.odometry_on = False


def clocks_set(seconds: int, car: LiveCar) -> None:
    car.shift += seconds * SECOND


def blind(car: LiveCar, sees: float) -> None:
    def cover(message: Any) -> None:
        message.ranges = [sees] * len(message.ranges)

    car.spoil = cover


def fewer_beams(car: LiveCar) -> None:
    def halve(message: Any) -> None:
        message.ranges = message.ranges[::2]
        message.angle_increment *= 2.0
        message.time_increment *= 2.0

    car.spoil = halve


def scans_stamped(restamp: Callable[[int], int], car: LiveCar) -> None:
    car.restamp_scan = restamp


def odometry_stamped(restamp: Callable[[int], int], car: LiveCar) -> None:
    car.restamp_odometry = restamp


def stuck() -> Callable[[int], int]:
    """A clock that stands still when it is first asked."""
    asked: list[int] = []

    def restamp(stamp: int) -> int:
        asked.append(stamp)
        return asked[0]

    return restamp


FAULTS = {
    "no scans": Fault(no_scans, "Nothing arrives on /scan any more", False, 4.0),
    "no odometry": Fault(no_odometry, "Nothing arrives on /odom any more", True),
    "clocks set back": Fault(
        partial(clocks_set, -10),
        "The stamps of the scans jumped by -10.0 s: a clock was set back, or a bag",
        True,
    ),
    "clocks set on": Fault(
        partial(clocks_set, 3600),
        "The stamps of the scans jumped by +3600.0 s: a clock was set. The drive",
        True,
    ),
    "clocks set right": Fault(partial(clocks_set, -3590), "The stamps of the scans jumped by -", True),
    "blind": Fault(partial(blind, sees=float("nan")), "The scans hold no readings", False),
    "covered": Fault(
        partial(blind, sees=float("inf")), "see nothing within 30 m: the laser is covered", False, 9.5
    ),
    "fewer beams": Fault(fewer_beams, "number of beams changed to 541", True),
    "scans' clock stuck": Fault(
        lambda car: scans_stamped(stuck(), car), "The stamps of the scans show no time", False, 2.0
    ),
    "odometry's clock stuck": Fault(
        lambda car: odometry_stamped(stuck(), car), "The stamps of the odometry show no time", False, 2.0
    ),
    "one clock set": Fault(
        partial(scans_stamped, lambda stamp: stamp + 3 * SECOND + TOLD_APART),
        "The stamps of the scans jumped by +",
        True,
    ),
    "one clock set a little": Fault(
        partial(scans_stamped, lambda stamp: stamp + 16 * SECOND // 10 + TOLD_APART),
        "The stamps of the scans were 1.6 s ahead of those of the odometry",
        True,
    ),
    "scans without stamps": Fault(partial(scans_stamped, lambda stamp: 0), "", True, 0.5),
    "odometry without stamps": Fault(partial(odometry_stamped, lambda stamp: 0), "", True, 0.5),
}


@pytest.fixture(scope="module", params=[localizer_stage, mapper_stage], ids=["localizer", "mapper"])
def stage(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    make: Callable[[Path], AbstractContextManager[Stage]] = request.param
    with make(tmp_path_factory.mktemp("faults")) as stage:
        stage.await_right()
        yield stage


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_told_once_and_lived_through(stage: Stage, name: str) -> None:
    fault, car = FAULTS[name], stage.car
    before, lost = stage.warnings(fault.words), stage.warnings("it may be lost")
    fault.begin(car)
    if fault.words:
        stage.await_diagnosis(fault.words)
    stage.bus.pass_time(round(fault.seconds * SECOND))
    if fault.is_mended:
        stage.await_right()
    car.scans_on = car.odometry_on = True
    car.spoil = lambda message: None
    car.restamp_scan = car.restamp_odometry = lambda stamp: stamp
    stage.await_right()
    if fault.words:
        assert stage.warnings(fault.words) == before + 1
    assert stage.warnings("it may be lost") == lost


def test_floods_are_lived_through_and_told(stage: Stage) -> None:
    stage.car.scans_per_sweep, stage.bus.are_workers_held_up = 20, True
    for _ in range(80):
        stage.publish("/initialpose", initial_pose(stage.car.place))
        stage.bus.pass_time(SECOND // 40)
    stage.car.scans_per_sweep, stage.bus.are_workers_held_up = 1, False
    stage.await_right()
    faults = stage.live.faults.counts
    assert ("too_fast" in faults) == bool(stage.live.summary()["dropped"])
    assert {"too_fast", "behind"} & set(faults)
