"""The command ``python -m benchmarks localizer``."""

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from benchmarks.commands import run
from benchmarks.localizer.localizer_benchmark import LocalizerFigures, Workload
from benchmarks.localizer.plain_filter import PlainFilter
from benchmarks.localizer.reference_kernels import add_up_loads
from benchmarks.localizer.stopwatch import Stopwatch
from benchmarks.localizer.tables import CHECKS, checks_table, times_table
from racecar.localization.floor.free_space import find_free_space
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.pipelines.simulation.plans.ring import draw_ring

SMALL = Workload(
    particles=500,
    beams=40,
    spread_particles=1000,
    rounds=2,
    steps=3,
    warm_up_steps=10,
    surveys=1,
    searches=1,
    pace_rounds=2,
    pace_steps=30,
)
FIGURES = LocalizerFigures(
    step_ms=1.0,
    step_parts_ms={"sensor": 0.75, "rest": 0.25},
    resampled=0.9,
    loads_ms=0.5,
    plain_step_ms=50.0,
    error_m=0.01,
    plain_error_m=0.02,
    cloud_ns_per_particle=100.0,
    spread_ns_per_particle=200.0,
    survey_seconds=1.5,
    search_gain=1.7,
    other_thread_pace=0.9,
    step_beside_thread_ms=3.0,
    loads_ratio=2.0,
    plain_ratio=50.0,
    spread_ratio=2.0,
)


@pytest.fixture(scope="module")
def ring() -> OccupancyGrid:
    return draw_ring()


def test_the_figures_of_a_small_map(
    ring: OccupancyGrid,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("benchmarks.localizer.localizer_benchmark.FULL", SMALL)
    monkeypatch.setattr("benchmarks.localizer.localizer_benchmark.benchmark_maps", lambda: {"ring": ring})
    path = tmp_path / "figures.json"
    assert run(["localizer", "--json", str(path)]) == 0
    shown = capsys.readouterr().out
    assert all(check.name in shown for check in CHECKS)
    report = json.loads(path.read_text())
    assert report["inputs"]["workload"]["particles"] == 500
    figures = report["maps"]["ring"]
    assert figures["error_m"] < 0.1
    assert figures["plain_error_m"] < 0.3
    assert 0.0 < figures["resampled"] <= 1.0
    assert figures["loads_ms"] > 0.0
    assert figures["survey_seconds"] > 0.0
    assert not figures["search_gain"] <= 0.0  # not a number on a machine with one core
    assert sum(figures["step_parts_ms"].values()) == pytest.approx(figures["step_ms"])
    check = report["checks"]["plain filter / full step"]
    assert check["ring"]["value"] == figures["plain_ratio"]
    assert check["ring"]["holds"] == (check["ring"]["value"] >= 40.0)


def test_a_check_that_is_missed_names_the_map() -> None:
    missed = replace(FIGURES, loads_ratio=2.52, plain_ratio=39.7, survey_seconds=2.1)
    page = StringIO()
    Console(file=page, width=200).print(
        checks_table({"near": FIGURES, "far": missed}), times_table({"a": FIGURES})
    )
    rows = {
        cells[0]: cells[1:]
        for cells in (_cells(line) for line in page.getvalue().splitlines() if line.startswith("|"))
    }
    assert rows["full step / bare loads"] == ["≤ 2.5", "2.00", "2.52", "no: far"]
    assert rows["plain filter / full step"] == ["≥ 40", "50.0", "39.7", "no: far"]
    assert rows["survey of the map (s)"] == ["≤ 2", "1.50", "2.10", "no: far"]
    assert rows["of the step: sensor (ms)"] == ["0.750"]


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("| ").split("|")]


def test_bare_loads_add_up_the_codes_of_all_points() -> None:
    rng = np.random.default_rng(0)
    codes = rng.integers(256, size=500, dtype=np.uint8)
    places, offsets = rng.integers(100, 400, 20), rng.integers(-100, 100, 7)
    assert add_up_loads(places, offsets, codes) == codes[places[:, None] + offsets].sum()


def test_marched_rays_end_where_exact_ones_do(ring: OccupancyGrid) -> None:
    poses = find_free_space(ring).draw_poses(200, np.random.default_rng(0))
    laser = np.array([0.1, 0.0, 0.0])
    bearings = np.linspace(-3.0, 3.0, 30)
    points = EndPoints(laser[:2] + np.column_stack([np.cos(bearings), np.sin(bearings)]), laser[:2])
    plain = PlainFilter(ring, 5.0, poses, np.random.default_rng(0))
    exact = np.minimum(cast_ray_fan(ring, compose(poses, laser), bearings, 9.0), 5.0)
    error = np.abs(plain.expected_cells(points) * ring.resolution - exact)
    is_outside = exact[:, 0] == 0.0  # the laser stands before the base, maybe in a wall
    assert np.mean(error[~is_outside] > 1.5 * ring.resolution) < 0.03


def test_a_ratio_is_taken_within_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounds of a fast and of a slow processor tell the same, and one with a disturbance little."""
    watch, now = Stopwatch(), [0.0]
    monkeypatch.setattr("benchmarks.localizer.stopwatch.time.thread_time", lambda: now[0])

    def work(seconds: float) -> None:
        now[0] += seconds

    for step, loads in ((10.0, 1.0), (2.0, 2.0), (3.0, 3.0)):
        watch.begin_round()
        watch.time("step", lambda step=step: work(step))
        watch.time("loads", lambda loads=loads: work(loads))
    assert watch.milliseconds("step") == pytest.approx(3000.0)
    assert watch.ratio("step", to="loads") == pytest.approx(1.0)
