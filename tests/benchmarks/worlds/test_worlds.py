"""The worlds can be driven, and their table tells the worst."""

import pytest

from benchmarks.harness.table import cells
from benchmarks.worlds.drive_errors import DriveErrors
from benchmarks.worlds.worlds import WORLDS, World, WorldDrive, map_drive, world_figures
from racecar.mapping.config import MappingConfig
from racecar.maps.shipped import shipped_names
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@pytest.mark.parametrize("world", WORLDS.values(), ids=list(WORLDS))
def test_every_world_is_a_map_and_settings_that_there_are(world: World) -> None:
    assert world.map in shipped_names()
    SimulationConfig(**world.settings, seed=1)


def test_every_fault_is_in_some_world() -> None:
    used = {name for world in WORLDS.values() for name in world.settings}
    faults = {"laser", "tilt", "hills", "kerbs", "posts", "carried", "carrier", "follower", "steering"}
    assert used >= faults | {"scan_every", "scan_gaps"}


def drive(relation: float, verdict: str | None) -> WorldDrive:
    errors = DriveErrors(200.0, relation, 10 * relation, 100 * relation, 4.0)
    return WorldDrive(errors, DriveErrors(200.0, 0.5, 1.0, 2.0, 9.0), 30, 29, ["odd"], verdict, 3.0)


def test_the_table_tells_mean_and_worst_of_the_drives() -> None:
    assert list(cells(world_figures([drive(0.01, "good"), drive(0.03, None)])).values()) == [
        *("0.020", "0.030", "0.30", "2.00", "3.00", "2.00%", "0.500", "2.00", "200"),
        *("58/60", "1 1", "good –", "3"),
    ]


@pytest.mark.slow
def test_a_drive_is_simulated_mapped_and_measured() -> None:
    world = World("track", {"duration": 8.0, "scan_every": 0.2, "noise": "none"})
    first, second = (map_drive(world, seed, MappingConfig()) for seed in (0, 1))
    for each in (first, second):
        assert each.scans == each.placed == pytest.approx(40, abs=1)
        assert each.errors.path_m > 8.0
        assert each.errors.relation_m < 0.05
        assert each.wheels.relation_m < 0.01
    assert first.errors != second.errors
