"""The worlds can be driven, and their table tells the worst."""

from io import StringIO

import pytest
from rich.console import Console

from benchmarks.worlds.drive_errors import DriveErrors
from benchmarks.worlds.tables import one_line, worlds_table
from benchmarks.worlds.world_benchmark import WorldFigures, measure_world
from benchmarks.worlds.worlds import WORLDS, World, choose_worlds
from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.shipped import shipped_names
from racecar.pipelines.simulation.plans.catalogue import ON_DEMAND
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@pytest.mark.parametrize("world", WORLDS.values(), ids=list(WORLDS))
def test_every_world_is_a_map_and_settings_that_there_are(world: World) -> None:
    assert world.map in {*shipped_names(), *ON_DEMAND}
    SimulationConfig(**world.settings, seed=1)


def test_every_fault_is_in_some_world() -> None:
    used = {name for world in WORLDS.values() for name in world.settings}
    faults = {"laser", "tilt", "hills", "kerbs", "posts", "carried", "carrier", "follower", "steering"}
    assert used >= faults | {"scan_every", "scan_gaps"}


def test_worlds_are_chosen_by_name() -> None:
    assert choose_worlds([]) == dict(WORLDS)
    assert list(choose_worlds(["short", "plain"])) == ["plain", "short"]
    with pytest.raises(UserError, match="campus"):
        choose_worlds(["moon"])


def figures(seed: int, relation: float, verdict: str | None) -> WorldFigures:
    errors = DriveErrors(200.0, relation, 10 * relation, 100 * relation, 4.0)
    return WorldFigures(seed, errors, DriveErrors(200.0, 0.5, 1.0, 2.0, 9.0), 30, 29, ("odd",), verdict, 3.0)


def test_the_table_tells_mean_and_worst_of_the_drives() -> None:
    console = Console(file=StringIO(), width=300)
    console.print(worlds_table({"slope": [figures(0, 0.01, "good"), figures(1, 0.03, None)]}))
    row = next(line for line in console.file.getvalue().splitlines() if "slope" in line)
    assert [cell.strip() for cell in row.strip("| ").split("|")] == [
        *("slope", "0.020", "0.030", "0.30", "2.00", "3.00", "2.00", "0.500", "2.00", "200"),
        *("58/60", "1 1", "good –", "3"),
    ]
    assert "0.010 m" in one_line("slope", figures(0, 0.01, None))


@pytest.mark.slow
def test_a_drive_is_simulated_mapped_and_measured() -> None:
    world = World("track", {"duration": 8.0, "scan_every": 0.2, "noise": "none"})
    first, second = measure_world(world, [0, 1], MappingConfig(), quiet=True)
    assert (first.seed, second.seed) == (0, 1)
    for drive in (first, second):
        assert drive.scans == drive.placed == pytest.approx(40, abs=1)
        assert drive.errors.path_m > 8.0
        assert drive.errors.relation_m < 0.05
        assert drive.wheels.relation_m < 0.01
    assert first.errors != second.errors
