"""A car whose lasers look front and rear is found on a map by the scans of both in turn."""

from dataclasses import replace

import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.ray_casting import cast_rays
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.scan import Scan
from tests.maps.shipped_plans import shipped_plan

PLACES = np.array([[0.3, 0.0, 0.0], [-0.3, 0.1, np.pi]])
BEARINGS = np.radians(np.arange(-90.0, 90.5))
EVERY = 4


@pytest.mark.slow
@pytest.mark.parametrize("has_wheels", [True, False])
def test_the_pose_is_right_whichever_laser_saw_last(has_wheels: bool) -> None:
    plan = shipped_plan("building")
    simulation = Simulation(plan, SimulationConfig(noise="slight", duration=8.0, max_speed=1.5))
    truth = simulation.ground_truth.map_from_base
    localizer = Localizer(plan, LocalizationConfig(), np.random.default_rng(0))
    localizer.set_pose(truth[0])
    errors, count = [], 0
    for message in simulation.messages():
        if not isinstance(message, Scan):
            if has_wheels:
                localizer.add_odometry(message)
            continue
        count += 1
        if (count - 1) % EVERY:
            continue
        laser = (count - 1) // EVERY % 2
        poses = np.tile(compose(truth[count - 1], PLACES[laser]), (len(BEARINGS), 1))
        ranges = cast_rays(plan, poses, BEARINGS, 30.0)
        seen = replace(
            message,
            bearings=BEARINGS,
            ranges=np.where(ranges < 30.0, ranges, np.inf),
            time_offsets=np.zeros(len(BEARINGS)),
            base_from_laser=PLACES[laser],
            laser=laser,
        )
        errors.append(localizer.add_scan(seen).map_from_base - truth[count - 1])
    distances = np.hypot(*np.array(errors)[:, :2].T)
    assert distances.mean() < 0.03
    assert distances.max() < 0.1
