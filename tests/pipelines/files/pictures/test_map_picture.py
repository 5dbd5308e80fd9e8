from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.pipelines.files.pictures import grid_drawing
from racecar.pipelines.files.pictures.colors import (
    DOUBT_COLOR,
    END_COLOR,
    LOOP_COLOR,
    PATH_COLOR,
    START_COLOR,
)
from racecar.pipelines.files.pictures.figure_files import MAP_DOTS_PER_INCH, save_figure
from racecar.pipelines.files.pictures.heading import Badge, Heading
from racecar.pipelines.files.pictures.map_picture import map_picture
from racecar.pipelines.files.tone import Tone

DRIVE = Heading("drive.bag")


def save_map_picture(path: Path, *arguments: Any, **options: Any) -> None:
    save_figure(path, map_picture(*arguments, **options), MAP_DOTS_PER_INCH)


def room(yaw: float = 0.0) -> OccupancyGrid:
    cells = np.full((200, 400), UNKNOWN, dtype=np.int8)
    cells[20:180, 20:380] = FREE
    cells[[20, 179], 20:380] = OCCUPIED
    cells[20:180, [20, 379]] = OCCUPIED
    return OccupancyGrid(cells, 0.05, np.array([-2.0, -2.0, yaw]))


def circle() -> np.ndarray:
    angle = np.linspace(0, 6, 100)
    return np.column_stack([8 + 3 * np.cos(angle), 3 + 3 * np.sin(angle)])


def has_color(image: np.ndarray, color: str) -> bool:
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return bool(np.any(np.all(np.abs(image.astype(int) - wanted) < 40, axis=2)))


@pytest.mark.parametrize("yaw", [0.0, 3.14])
def test_picture_shows_map_path_and_loops(tmp_path: Path, yaw: float) -> None:
    path = tmp_path / "map.png"
    save_map_picture(path, room(yaw), [circle()], DRIVE, loops=[circle()[[0, 99]]])
    image = np.asarray(Image.open(path).convert("RGB"))
    assert image.shape[1] >= 2000
    assert has_color(image, PATH_COLOR)
    assert has_color(image, LOOP_COLOR)
    assert np.all(image > 245, axis=2).mean() > 0.2  # free floor
    assert np.all(image < 60, axis=2).mean() > 0.001  # walls


@pytest.mark.parametrize(("count", "entries"), [(0, []), (2, ["loop closures (2)"])])
def test_the_legend_names_loops_only_where_there_are_some(count: int, entries: list[str]) -> None:
    figure = map_picture(room(), [circle()], DRIVE, loops=[circle()[[0, 99]]] * count)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [text for text in texts if "loop" in text] == entries


def test_same_run_same_bytes(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        save_map_picture(tmp_path / name, room(), [circle()], DRIVE)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_smallest_run(tmp_path: Path) -> None:
    grid = OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 0.05, np.zeros(3))
    save_map_picture(tmp_path / "map.png", grid, [np.zeros((1, 2))], DRIVE)
    assert (tmp_path / "map.png").stat().st_size > 0


def test_a_title_may_be_any_name(tmp_path: Path) -> None:
    for title in ("$\\broken$_{", "\udcff\udce4.bag", "录音.bag"):
        save_map_picture(tmp_path / "map.png", room(), [circle()], Heading(title))
        assert (tmp_path / "map.png").stat().st_size > 0


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_huge_map_looks_as_if_it_were_small(
    tmp_path: Path, yaw: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pictures = []
    for most in (10**9, 20_000):
        monkeypatch.setattr(grid_drawing, "MOST_DRAWN_CELLS", most)
        save_map_picture(tmp_path / "map.png", room(yaw), [circle()], DRIVE)
        pictures.append(np.asarray(Image.open(tmp_path / "map.png").convert("L").resize((300, 200))))
    dark = [picture < 128 for picture in pictures]
    assert np.mean(dark[0] & ~dark[1]) < 0.02
    assert np.mean(np.abs(pictures[0].astype(float) - pictures[1])) < 12.0


def test_doubtful_segments_are_marked(tmp_path: Path) -> None:
    for name, segments in (("without.png", []), ("with.png", [circle()[10:21], circle()[60:71]])):
        save_map_picture(tmp_path / name, room(), [circle()], DRIVE, doubtful=segments)
    images = [np.asarray(Image.open(tmp_path / name).convert("RGB")) for name in ("without.png", "with.png")]
    assert [has_color(image, DOUBT_COLOR) for image in images] == [False, True]


def test_no_scale_bar_lies_in_the_map() -> None:
    floor = OccupancyGrid(np.full((200, 400), FREE, dtype=np.int8), 0.05, np.zeros(3))
    figure = map_picture(floor, [circle()], DRIVE)
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
    middle = np.array([[shape[1], shape[0]]]) * 0.025
    facts = ("cells of 5 cm", "62 × 3 m", "60 m driven in 2 min", "2026-11-27 13:02 UTC")
    badge = Badge("good", Tone.GOOD)
    heading = Heading("a_drive_with_a_long_name_2026-11-27-13-02-06.bag", badge, facts, "The map is good.")
    figure = map_picture(grid, [middle], heading)
    save_figure(tmp_path / "map.png", figure, 100)
    left, bottom, right, top = figure.axes[0].get_position().extents * np.tile(figure.get_size_inches(), 2)
    assert max(right - left, top - bottom) > 10.5
    beside, above_and_beneath = figure.get_size_inches() - [right - left, top - bottom]
    assert beside < (1.5 if right - left > 3.4 else 4.0)
    assert above_and_beneath < 4.0


def test_specks_far_away_are_not_in_the_picture() -> None:
    grid = room()
    cells = np.full((1000, 2000), UNKNOWN, dtype=np.int8)
    cells[:200, :400] = grid.cells
    cells[990, 1990:1995] = OCCUPIED
    figure = map_picture(OccupancyGrid(cells, grid.resolution, grid.map_from_grid), [circle()], DRIVE)
    np.testing.assert_allclose(figure.axes[0].get_xlim(), (-2.0, 18.0), atol=0.1)
    np.testing.assert_allclose(figure.axes[0].get_ylim(), (-2.0, 8.0), atol=0.1)


def test_walls_that_few_beams_met_are_in_the_picture() -> None:
    cells = np.full((400, 400), UNKNOWN, dtype=np.int8)
    cells[100:140, 100:140] = FREE
    cells[120, 140:380:25] = OCCUPIED  # one cell each 1.25 m
    figure = map_picture(OccupancyGrid(cells, 0.05, np.zeros(3)), [np.full((1, 2), 6.0)], DRIVE)
    assert figure.axes[0].get_xlim()[1] > 18.5


def test_a_drive_that_ends_where_it_starts_shows_both(tmp_path: Path) -> None:
    standing = np.tile([8.0, 3.0], (3, 1))
    save_map_picture(tmp_path / "map.png", room(), [standing], DRIVE)
    picture = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))
    over_the_map = picture[: picture.shape[0] * 3 // 4]  # and not the legend beneath
    assert has_color(over_the_map, START_COLOR)
    assert has_color(over_the_map, END_COLOR)


def test_no_line_leads_from_a_drive_to_the_next() -> None:
    drives = [circle()[:40], circle()[40:]]
    figure = map_picture(room(), drives, Heading("two drives"))
    lines = figure.axes[0].lines
    paths = [np.transpose(line.get_data()) for line in lines if line.get_color() == PATH_COLOR]
    for path, drive in zip(paths, drives, strict=True):
        np.testing.assert_allclose(path, drive)
    first, last = (next(line for line in lines if line.get_label() == label) for label in ("start", "end"))
    np.testing.assert_allclose(np.transpose(first.get_data()), circle()[[0, 40]])
    np.testing.assert_allclose(np.transpose(last.get_data()), circle()[[39, 99]])


@pytest.mark.parametrize("shape", [(400, 60), (60, 400), (300, 400)])
def test_verdict_and_facts_are_above_the_map(shape: tuple[int, int]) -> None:
    caution = "The map is wrong: walls lie apart at (1.0, 2.0), where the car passed twice, half a metre off."
    facts = ("cells of 5 cm", "20 × 3 m", "12 m driven in 60 s", "2026-11-27 13:02 UTC")
    grid = OccupancyGrid(np.full(shape, FREE, dtype=np.int8), 0.05, np.zeros(3))
    heading = Heading("drive.bag", Badge("wrong", Tone.BAD), facts, caution)
    figure = map_picture(grid, [np.array([[1.0, 1.0], [2.0, 2.0]])], heading)
    figure.draw_without_rendering()
    said = [text for text in (*figure.texts, *figure.artists) if isinstance(text, Text)]
    words = " ".join(" ".join(text.get_text().split()) for text in said)
    for expected in ("drive.bag", "wrong", *facts, caution):
        assert expected in words
    map_top = figure.axes[0].get_window_extent().y1
    for box in (text.get_window_extent() for text in said if text.get_text()):
        assert box.x0 >= 0.0
        assert box.x1 <= figure.bbox.x1
        assert map_top < box.y0 < box.y1 <= figure.bbox.y1
