from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.pictures import map_picture as module
from racecar.pipelines.files.pictures.map_picture import (
    DOUBT_COLOR,
    END_COLOR,
    LOOP_COLOR,
    MAP_DOTS_PER_INCH,
    PATH_COLOR,
    START_COLOR,
    map_picture,
    save_figure,
)


def save_map_picture(path: Path, *arguments: Any) -> None:
    save_figure(path, map_picture(*arguments), MAP_DOTS_PER_INCH)


def room(yaw: float = 0.0) -> OccupancyGrid:
    cells = np.full((200, 400), UNKNOWN, dtype=np.int8)
    cells[20:180, 20:380] = FREE
    cells[[20, 179], 20:380] = OCCUPIED
    cells[20:180, [20, 379]] = OCCUPIED
    return OccupancyGrid(cells, 0.05, np.array([-2.0, -2.0, yaw]))


def circle() -> Trajectory:
    angle = np.linspace(0, 6, 100)
    places = np.column_stack([8 + 3 * np.cos(angle), 3 + 3 * np.sin(angle), angle])
    return Trajectory(np.arange(100), places)


def has_color(image: np.ndarray, color: str) -> bool:
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return bool(np.any(np.all(np.abs(image.astype(int) - wanted) < 40, axis=2)))


@pytest.mark.parametrize("yaw", [0.0, 3.14])
def test_picture_shows_map_path_and_loops(tmp_path: Path, yaw: float) -> None:
    loop = Constraint(0, 3, np.zeros(3), np.eye(3), "loop_closure")
    near = Constraint(0, 1, np.zeros(3), np.eye(3), "scan_matching")
    path = tmp_path / "map.png"
    save_map_picture(
        path, room(yaw), circle(), circle().map_from_base[[0, 30, 60, 99]], [near, loop], "drive.bag"
    )
    image = np.asarray(Image.open(path).convert("RGB"))
    assert image.shape[1] >= 2000
    assert has_color(image, PATH_COLOR)
    assert has_color(image, LOOP_COLOR)
    assert np.all(image > 245, axis=2).mean() > 0.2  # free floor
    assert np.all(image < 60, axis=2).mean() > 0.001  # walls


@pytest.mark.parametrize(("count", "entries"), [(0, []), (2, ["loop closures (2)"])])
def test_the_legend_names_loops_only_where_there_are_some(count: int, entries: list[str]) -> None:
    loops = [Constraint(0, 3, np.zeros(3), np.eye(3), "loop_closure")] * count
    figure = map_picture(room(), circle(), circle().map_from_base[[0, 30, 60, 99]], loops, "drive.bag")
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [text for text in texts if "loop" in text] == entries


def test_same_run_same_bytes(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        save_map_picture(tmp_path / name, room(), circle(), circle().map_from_base[[0, 99]], [], "drive.bag")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_smallest_run(tmp_path: Path) -> None:
    grid = OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 0.05, np.zeros(3))
    alone = Trajectory(np.array([0]), np.zeros((1, 3)))
    save_map_picture(tmp_path / "map.png", grid, alone, alone.map_from_base, [], "one scan")
    assert (tmp_path / "map.png").stat().st_size > 0


def test_a_title_may_be_any_name(tmp_path: Path) -> None:
    for title in ("$\\broken$_{", "\udcff\udce4.bag", "录音.bag"):
        save_map_picture(tmp_path / "map.png", room(), circle(), circle().map_from_base[:1], [], title)
        assert (tmp_path / "map.png").stat().st_size > 0


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_huge_map_looks_as_if_it_were_small(
    tmp_path: Path, yaw: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pictures = []
    for most in (10**9, 20_000):
        monkeypatch.setattr(module, "MOST_DRAWN_CELLS", most)
        save_map_picture(tmp_path / "map.png", room(yaw), circle(), circle().map_from_base[:1], [], "drive")
        pictures.append(np.asarray(Image.open(tmp_path / "map.png").convert("L").resize((300, 200))))
    dark = [picture < 128 for picture in pictures]
    assert np.mean(dark[0] & ~dark[1]) < 0.02
    assert np.mean(np.abs(pictures[0].astype(float) - pictures[1])) < 12.0


def test_doubtful_segments_are_marked(tmp_path: Path) -> None:
    poses = circle().map_from_base
    doubtful = DoubtfulSegment("Walls lie apart.", (10, 20), poses[15, :2], (1.0, 2.0), (60, 70))
    for name, segments in (("without.png", []), ("with.png", [doubtful])):
        save_map_picture(tmp_path / name, room(), circle(), poses, [], "drive", segments)
    images = [np.asarray(Image.open(tmp_path / name).convert("RGB")) for name in ("without.png", "with.png")]
    assert [has_color(image, DOUBT_COLOR) for image in images] == [False, True]


def test_no_scale_bar_lies_in_the_map() -> None:
    floor = OccupancyGrid(np.full((200, 400), FREE, dtype=np.int8), 0.05, np.zeros(3))
    figure = map_picture(floor, circle(), circle().map_from_base[:1], [], "drive")
    figure.draw_without_rendering()
    (bar,) = [text for text in figure.axes[0].texts if text.get_text() == "2 m"]
    assert bar.get_window_extent().y1 < figure.axes[0].get_window_extent().y0
    inside = figure.axes[0].get_window_extent().extents.round().astype(int)
    figure.canvas.draw()
    shown = np.asarray(figure.canvas.buffer_rgba())[::-1, :, :3]  # type: ignore[attr-defined]
    shown = shown[inside[1] + 2 : inside[3] - 2, inside[0] + 2 : inside[2] - 2]
    assert not np.any(np.all(shown < 60, axis=2))


@pytest.mark.parametrize("shape", [(60, 1240), (1240, 60), (200, 1200), (1200, 500), (400, 400)])
def test_the_map_fills_its_picture_whatever_its_shape(shape: tuple[int, int], tmp_path: Path) -> None:
    grid = OccupancyGrid(np.full(shape, FREE, dtype=np.int8), 0.05, np.zeros(3))
    places = np.column_stack([np.array([shape[1], shape[0]]) * 0.025 * np.ones((2, 1)), np.zeros(2)])
    title = "a_drive_with_a_long_name_2026-11-27-13-02-06.bag"
    figure = map_picture(grid, Trajectory(np.arange(2), places), places, [], title)
    save_figure(tmp_path / "map.png", figure, 100)
    left, bottom, right, top = figure.axes[0].get_position().extents * np.tile(figure.get_size_inches(), 2)
    assert max(right - left, top - bottom) > 10.5
    beside, above_and_beneath = figure.get_size_inches() - [right - left, top - bottom]
    assert beside < 3.0
    assert above_and_beneath < 2.0


def test_a_drive_that_ends_where_it_starts_shows_both(tmp_path: Path) -> None:
    standing = Trajectory(np.arange(3), np.tile([8.0, 3.0, 0.0], (3, 1)))
    save_map_picture(tmp_path / "map.png", room(), standing, standing.map_from_base, [], "drive.bag")
    picture = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))
    over_the_map = picture[: picture.shape[0] * 3 // 4]  # and not the legend beneath
    assert has_color(over_the_map, START_COLOR)
    assert has_color(over_the_map, END_COLOR)


def test_no_line_leads_from_a_drive_to_the_next() -> None:
    figure = map_picture(room(), circle(), circle().map_from_base, [], "two drives", starts=[40])
    named = {str(line.get_label()): line for line in figure.axes[0].lines}
    path, first, last = (named[label] for label in ("path", "start", "end"))
    x, y = np.asarray(path.get_data())
    assert np.isnan(x[40])
    assert np.isfinite(np.delete(x, 40)).all()
    np.testing.assert_allclose(np.delete(y, 40), circle().map_from_base[:, 1])
    np.testing.assert_allclose(np.transpose(first.get_data()), circle().map_from_base[[0, 40], :2])
    np.testing.assert_allclose(np.transpose(last.get_data()), circle().map_from_base[[39, 99], :2])


@pytest.mark.parametrize("is_tall", [False, True])
def test_a_map_that_is_not_good_says_so_in_its_picture(is_tall: bool, tmp_path: Path) -> None:
    caution = "The map is wrong: walls lie apart at (1.0, 2.0), where the car passed twice, half a metre off."
    cells = np.full((400, 60) if is_tall else (60, 400), FREE, dtype=np.int8)
    drive = Trajectory(np.arange(2), np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0]]))
    figure = map_picture(
        OccupancyGrid(cells, 0.05, np.zeros(3)), drive, drive.map_from_base, [], "drive.bag", caution=caution
    )
    save_figure(tmp_path / "map.png", figure, MAP_DOTS_PER_INCH)
    assert " ".join(figure.get_suptitle().split()).endswith(caution)
    box = figure._suptitle.get_window_extent()  # type: ignore[attr-defined]
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.x1
