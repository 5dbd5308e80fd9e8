"""The same floor on maps of several resolutions: what a scan says of a pose stays the same."""

from functools import cache

import numpy as np
import pytest

from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, beam_model_of, free_space_of
from tests.maps.drives import BEARINGS

RESOLUTIONS = (0.02, 0.05, 0.1)
KINDS = pytest.mark.parametrize("kind", ["table", "rays"])
TRUTH = np.array([9.03, 4.02, 0.4])


@cache
def floor(resolution: float) -> OccupancyGrid:
    """18 m by 8 m, with a pillar, a cabinet and a way out; all walls on edges of the coarsest cells."""
    cells = np.full((round(8.0 / resolution), round(18.0 / resolution)), OCCUPIED, dtype=np.int8)

    def fill(left: float, low: float, right: float, high: float, value: int) -> None:
        edges = [round(metres / resolution) for metres in (left, low, right, high)]
        cells[edges[1] : edges[3], edges[0] : edges[2]] = value

    fill(0.4, 0.4, 17.6, 7.6, FREE)
    fill(11.0, 2.0, 11.6, 2.6, OCCUPIED)
    fill(4.0, 4.4, 7.6, 7.6, OCCUPIED)
    fill(14.0, 0.4, 14.2, 5.0, OCCUPIED)
    return OccupancyGrid(cells, resolution, IDENTITY)


@cache
def model(kind: str, resolution: float) -> BeamModel:
    free_space = free_space_of(floor(resolution))
    return beam_model_of(free_space, with_table=kind == "table")


def scan_from(pose: Pose) -> Beams:
    return Beams(BEARINGS, cast_ray_fan(floor(0.05), pose[None], BEARINGS, 30.0)[0], IDENTITY.copy(), 30.0)


@KINDS
def test_differences_of_log_likelihoods_agree_on_maps_of_all_resolutions(kind: str) -> None:
    """To a tenth of their spread about the true pose; to a thousandth where rays are cast."""
    poses = TRUTH + [0.25, 0.25, 0.1] * np.random.default_rng(0).standard_normal((300, 3))
    poses = np.vstack([TRUTH, poses])
    nats = []
    for resolution in RESOLUTIONS:
        log_likelihood = model(kind, resolution).log_likelihood(poses, scan_from(TRUTH))
        nats.append(log_likelihood - log_likelihood[0])
    spread = np.std(nats[1])
    assert spread > 5.0
    for others in (nats[0], nats[2]):
        assert np.corrcoef(nats[1], others)[0, 1] > 0.997
        difference = np.sqrt(np.mean((others - nats[1]) ** 2))
        assert difference < (0.001 if kind == "rays" else 0.1) * spread


@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_a_reading_two_decimetres_short_costs_half_a_nat_on_every_map(resolution: float) -> None:
    """2.69, 0.48 and 0.12 nats they were when the deviation was four cells."""
    pose, straight_at_a_wall = np.array([[9.05, 4.05, 0.0]]), np.array([np.pi / 2])
    exact = cast_ray_fan(floor(0.05), pose, straight_at_a_wall, 30.0)[0]
    nats = []
    for short in (0.0, 0.2):
        beams = Beams(straight_at_a_wall, exact - short, IDENTITY.copy(), 30.0)
        nats.append(CONFIG.squash * model("table", resolution).log_likelihood(pose, beams)[0])
    assert nats[0] - nats[1] == pytest.approx(0.48, abs=0.01)


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("with_table", [True, False])
def test_walls_are_seen_beyond_thirteen_metres_on_every_map(resolution: float, with_table: bool) -> None:
    """640 cells of 2 cm are 12.8 m."""
    pose = np.array([[0.83, 2.83, 0.0]])
    bearings = np.linspace(0.175, 0.21, 8)
    exact = cast_ray_fan(floor(0.05), pose, bearings, 30.0)[0]
    assert exact.max() > 14.0
    beams = Beams(bearings, exact, IDENTITY.copy(), 30.0)
    expected = beam_model_of(free_space_of(floor(resolution)), with_table).expected_ranges(pose, beams)[0]
    assert np.median(np.abs(expected - exact)) < 0.1
