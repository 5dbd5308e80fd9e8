"""The one configuration serves other laser scanners: slower, coarser, of shorter sight."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import mapped, mean_error
from tests.maps.shipped_plans import shipped_plan


@dataclass(frozen=True)
class Scanner:
    """A laser scanner that is worse than the simulated one."""

    every_scan: int
    every_beam: int
    view: float
    """Radians to either side."""
    max_range: float
    noise: float
    """Metres of standard deviation."""

    def sees(self, scan: Scan, rng: np.random.Generator) -> Scan:
        """What it reads of what the simulated one does."""
        seen = np.flatnonzero(np.abs(scan.bearings) <= self.view)[:: self.every_beam]
        ranges = scan.ranges[seen] + self.noise * rng.standard_normal(len(seen))
        ranges[ranges >= self.max_range] = np.inf
        return replace(
            scan,
            bearings=scan.bearings[seen],
            ranges=ranges,
            time_offsets=scan.time_offsets[seen],
            max_range=self.max_range,
        )


SCANNERS = {
    "household": Scanner(8, 6, np.pi, 3.5, 0.015),
    "table top": Scanner(5, 3, np.pi, 12.0, 0.02),
    "industrial": Scanner(8, 4, 0.5 * np.pi, 30.0, 0.01),
}


@cache
def simulation() -> Simulation:
    return Simulation(
        shipped_plan("building"), SimulationConfig(noise="slight", seed=5, duration=25.0, max_speed=1.5)
    )


@cache
def drive(scanner: Scanner) -> tuple[list[Scan | Odometry], Pose]:
    """Messages, and the truth (N, 3) at each scan. Odometry turns and stretches what it tells."""
    rng, messages, kept, scans = np.random.default_rng(0), [], [], 0
    odom_from_base, last = np.zeros(3), None
    for message in simulation().messages():
        if isinstance(message, Scan):
            if scans % scanner.every_scan == 0:
                messages.append(scanner.sees(message, rng))
                kept.append(scans)
            scans += 1
            continue
        step = np.zeros(3) if last is None else between(last, message.odom_from_base)
        last = message.odom_from_base
        odom_from_base = compose(odom_from_base, step * [0.97, 0.97, 1.0] + [0.0, 0.0, 0.05 * step[0]])
        messages.append(replace(message, odom_from_base=odom_from_base))
    return messages, simulation().ground_truth.map_from_base[kept]


@pytest.mark.parametrize("scanner", SCANNERS.values(), ids=SCANNERS)
def test_maps(scanner: Scanner) -> None:
    messages, truth = drive(scanner)
    assert mean_error(mapped(messages), truth) < 0.14


@pytest.mark.parametrize("start", ["told", "anywhere"])
@pytest.mark.parametrize("scanner", SCANNERS.values(), ids=SCANNERS)
def test_localizes(scanner: Scanner, start: str) -> None:
    messages, truth = drive(scanner)
    localizer = Localizer(shipped_plan("building"), LocalizationConfig(), np.random.default_rng(0))
    if start == "told":
        localizer.set_pose(truth[0])
    found = np.array([replayed.answer.map_from_base for replayed in replay(messages, localizer)])
    missed = np.hypot(*(found - truth)[:, :2].T)
    settled = missed[len(missed) // 5 :]
    assert settled.mean() < 0.03
    assert settled.max() < 0.2
