from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.pictures.colors import LOOP_COLOR
from racecar.pipelines.files.pictures.figure_files import DOTS_PER_INCH, save_figure
from racecar.pipelines.files.pictures.heading import Heading
from racecar.pipelines.files.pictures.moments import Moment
from racecar.pipelines.files.pictures.overlay import overlay, titles_of


def draw(path: Path, moments: int, points: int) -> Image.Image:
    cells = np.full((60, 100), FREE, dtype=np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    grid = OccupancyGrid(cells, 0.1, np.array([2.0, 1.0, 3.0]))
    poses = np.column_stack([np.linspace(0, -3, 20), np.zeros(20), np.zeros(20)])
    trajectory = Trajectory(np.arange(20) * 10**9, poses)
    share = 0.5 if points else np.nan
    scan = np.random.default_rng(0).uniform(-2, 2, (points, 2))
    figure = overlay(grid, trajectory, [Moment(10**9, poses[1], scan, share)] * moments, Heading("drive.bag"))
    save_figure(path, figure, DOTS_PER_INCH)
    return Image.open(path).convert("RGB")


def share_of(picture: Image.Image, color: str) -> float:
    wanted = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
    return float(np.mean(np.all(np.abs(np.asarray(picture).astype(int) - wanted) < 12, axis=2)))


@pytest.mark.parametrize("moments", [0, 1, 6])
def test_a_panel_for_each_moment(tmp_path: Path, moments: int) -> None:
    picture = draw(tmp_path / "overlay.png", moments, points=300)
    assert picture.width > 1500
    assert picture.height > (1200 if moments > 3 else 500)
    assert picture.width / picture.height > 0.4


def test_the_scan_is_drawn(tmp_path: Path) -> None:
    with_scan = share_of(draw(tmp_path / "a.png", 3, points=300), LOOP_COLOR)
    without = share_of(draw(tmp_path / "b.png", 3, points=0), LOOP_COLOR)
    assert with_scan > 2 * without


def test_the_same_bytes_again(tmp_path: Path) -> None:
    draw(tmp_path / "a.png", 2, points=50)
    draw(tmp_path / "b.png", 2, points=50)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_panels_say_which_is_the_worst_and_which_the_end() -> None:
    seconds, shares = (30.0, 10.0, 70.0), (0.4, 0.9, np.nan)
    moments = [
        Moment(int(second * 1e9), np.zeros(3), np.empty((0, 2)), share)
        for second, share in zip(seconds, shares, strict=True)
    ]
    assert titles_of(moments, 0) == [
        "1 (worst): 30 s, 40% on walls",
        "2: 10 s, 90% on walls",
        "3 (end): 70 s",
    ]
