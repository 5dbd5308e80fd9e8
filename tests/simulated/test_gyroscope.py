"""Cheap gyroscopes beside wheels that slip or know no turns, mapped and localized."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.motion.turn_fusion import TurnModel
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

SLIPPING: dict[str, Any] = {"noise": "full", "slip": 0.25, "max_speed": 4.0}
CALM: dict[str, Any] = {"noise": "slight", "max_speed": 2.0}

Fault = Callable[[float], float]


class Drive:
    """A simulated drive, of which every fourth scan is used."""

    def __init__(self, plan: str, seconds: float, seed: int, imu_rate: float, **settings: object) -> None:
        self.grid = plan_of(plan)
        config = SimulationConfig(duration=seconds, seed=seed, imu_rate=imu_rate, **settings)
        simulation = Simulation(self.grid, config)
        scans = 0
        self.messages: list[Measurement] = []
        for message in simulation.messages():
            scans += isinstance(message, Scan)
            if not isinstance(message, Scan) or scans % 4 == 1:
                self.messages.append(message)
        self.truth = simulation.ground_truth.map_from_base[::4]

    def with_fault(self, fault: Fault | None, *, know_turns: bool) -> Iterator[Measurement]:
        """The messages with a gyroscope at fault, or none, and wheels that know turns, or distances only."""
        metres, last = 0.0, IDENTITY
        for message in self.messages:
            if isinstance(message, YawRate):
                if fault is not None:
                    yield YawRate(message.stamp, fault(message.rate))
            elif isinstance(message, Odometry) and not know_turns:
                step = between(last, message.odom_from_base)
                metres += float(np.copysign(np.hypot(step[0], step[1]), step[0]))
                last = message.odom_from_base
                yield Odometry(message.stamp, np.array([metres, 0.0, 0.0]), message.twist)
            else:
                yield message


@cache
def plan_of(name: str) -> OccupancyGrid:
    return load_map(Path(name))


def right(rate: float) -> float:
    return rate


def dead(rate: float) -> float:
    return 0.0


def mapped(drive: Drive, fault: Fault | None, *, know_turns: bool = True) -> tuple[Pose, TurnModel]:
    """Errors (N, 3) of the poses seen from the first one, in metres and degrees."""
    mapper = Mapper(MappingConfig())
    for message in drive.with_fault(fault, know_turns=know_turns):
        feed(message, mapper)
    return errors(drive.truth, mapper.finish().trajectory.map_from_base), mapper.turn_model


Run = Callable[[Drive, Fault | None], tuple[Pose, TurnModel]]


def localized(drive: Drive, fault: Fault | None, *, know_turns: bool = True) -> tuple[Pose, TurnModel]:
    localizer = Localizer(drive.grid, LocalizationConfig(), np.random.default_rng(0))
    localizer.set_pose(drive.truth[0])
    answers = (feed(message, localizer) for message in drive.with_fault(fault, know_turns=know_turns))
    found = np.array([answer.map_from_base for answer in answers if answer is not None])
    missed = between(drive.truth[: len(found)], found)
    metres, degrees = np.hypot(missed[:, 0], missed[:, 1]), np.degrees(np.abs(missed[:, 2]))
    return np.column_stack([metres, degrees]), localizer.turn_model


def errors(truth: Pose, found: NDArray[np.float64]) -> Pose:
    truth = truth[: len(found)]
    missed = between(between(truth[0], truth), between(found[0], found))
    return np.column_stack([np.hypot(missed[:, 0], missed[:, 1]), np.degrees(np.abs(missed[:, 2]))])


@pytest.mark.parametrize("rate", [10.0, 200.0])
def test_a_map_with_wheels_that_know_no_turns(rate: float) -> None:
    """Over several drives, since slip alone turns one map by 1 degree and another by 5."""
    worst = []
    for seed in (2, 3, 4):
        drive = Drive("track", 12.0, seed, rate, **SLIPPING)
        with_gyro, model = mapped(drive, right, know_turns=False)
        assert model.is_believed
        worst.append(with_gyro[:, 1].max())
    assert np.mean(worst) < 5.0  # without it is 12


@pytest.mark.parametrize("rate", [10.0, 200.0])
def test_a_car_with_wheels_that_know_no_turns_is_not_lost(rate: float) -> None:
    drive = Drive("track", 12.0, 1, rate, **SLIPPING)
    assert localized(drive, right, know_turns=False)[0][:, 0].mean() < 0.08  # without it is over 1


@pytest.mark.parametrize(
    "fault",
    [dead, np.degrees, np.negative, lambda rate: 0.01 * np.sin(1e3 * rate)],
    ids=["dead", "degrees", "negated", "no turns"],
)
def test_a_gyroscope_at_fault_does_no_harm(fault: Fault) -> None:
    for run in (mapped, localized):
        at_fault, model = run(calm_drive(), fault)
        assert not model.is_used
        np.testing.assert_array_equal(at_fault, without_gyroscope(run))


@cache
def calm_drive() -> Drive:
    return Drive("track", 8.0, 2, 50.0, **CALM)


@cache
def without_gyroscope(run: Run) -> Pose:
    return run(calm_drive(), None)[0]


@pytest.mark.slow
@pytest.mark.parametrize("plan", ["bare_corridor", "track"])
@pytest.mark.parametrize("know_turns", [True, False])
@pytest.mark.parametrize("settings", [CALM, SLIPPING], ids=["calm", "slipping"])
@pytest.mark.parametrize("rate", [10.0, 200.0])
def test_headings_of_a_longer_map(plan: str, know_turns: bool, settings: dict[str, Any], rate: float) -> None:
    for seed in (1, 2, 3):
        drive = Drive(plan, 45.0, seed, rate, **settings)
        assert mapped(drive, right, know_turns=know_turns)[0][:, 1].max() < 1.0
