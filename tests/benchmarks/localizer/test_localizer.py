"""The command ``python -m benchmarks localizer``."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.commands import run
from benchmarks.localizer.localizer import CHECKS, Check, Workload
from benchmarks.localizer.plain_filter import PlainFilter
from benchmarks.localizer.reference_kernels import add_up_loads
from benchmarks.localizer.stopwatch import Stopwatch
from racecar.localization.floor.free_space import find_free_space
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map

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


@pytest.fixture(scope="module")
def ring() -> OccupancyGrid:
    return load_map("ring")


def test_the_figures_of_a_small_map(
    ring: OccupancyGrid,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("benchmarks.localizer.localizer.FULL", SMALL)
    monkeypatch.setattr("benchmarks.localizer.localizer.benchmark_maps", lambda: {"ring": ring})
    path = tmp_path / "figures.json"
    assert run(["localizer", "--json", str(path)]) == 0
    shown = capsys.readouterr().out
    assert all(check in shown for check in CHECKS)
    assert "of the step: sensor (ms)" in shown
    report = json.loads(path.read_text())
    figures = report["maps"]["ring"]
    assert figures["error_m"] < 0.1
    assert figures["plain_error_m"] < 0.3
    assert 0.0 < figures["resampled"] <= 1.0
    assert figures["loads_ms"] > 0.0
    assert figures["survey_seconds"] > 0.0
    assert not figures["search_gain"] <= 0.0  # not a number on a machine with one core
    assert sum(figures["step_parts_ms"].values()) == pytest.approx(figures["step_ms"])


def test_a_check_that_is_missed_names_the_map() -> None:
    check = Check("loads_ratio", 2.5, True)
    maps: Any = {"near": SimpleNamespace(loads_ratio=2.0), "far": SimpleNamespace(loads_ratio=2.52)}
    assert check.cells(maps) == {"bar": "≤ 2.5", "near": "2.00", "far": "2.52", "holds": "no: far"}
    lower = Check("loads_ratio", 2.0, False, ".1f")
    assert lower.cells(maps) == {"bar": "≥ 2", "near": "2.0", "far": "2.5", "holds": "yes"}


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
