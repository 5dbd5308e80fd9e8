"""Map files: what nav2 reads, what it writes, and one clear sentence for each bad input."""

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray
from PIL import Image

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import MODES, MOST_PIXELS, Mode, as_written, find_map, load_map, save_map
from racecar.maps.shipped import shipped_names
from tests.maps.grid.tiles import in_tiles

DATA = Path(os.environ.get("RACECAR_DATA", Path(__file__).parents[2].parent / "shared" / "data"))

HEADER = {
    "image": "map.png",
    "resolution": 0.05,
    "origin": [1.0, -2.0, 0.5],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def write_map(
    folder: Path, pixels: NDArray[np.generic] | list[list[int]], without: str = "", **changes: object
) -> Path:
    Image.fromarray(np.asarray(pixels, dtype=np.uint8) if isinstance(pixels, list) else pixels).save(
        folder / "map.png"
    )
    header = {key: value for key, value in {**HEADER, **changes}.items() if key != without}
    (folder / "map.yaml").write_text(yaml.safe_dump(header))
    return folder / "map.yaml"


def coloured(*pixels: tuple[int, ...]) -> NDArray[np.uint8]:
    return np.array([pixels], dtype=np.uint8)


BETWEEN = {"free_thresh": 0.1, "occupied_thresh": 0.9}


@pytest.mark.parametrize(
    ("pixels", "changes", "cells"),
    [
        # (255 - 89) / 255 = 0.651 is above, (255 - 90) / 255 = 0.647 below the threshold; rows turn round
        ([[0, 88, 89], [90, 205, 254]], {}, [[-1, -1, 0], [100, 100, 100]]),
        ([[0, 128, 255]], {"negate": 1}, [[0, -1, 100]]),
        ([[204, 51]], {"free_thresh": 0.2, "occupied_thresh": 0.8}, [[-1, -1]]),  # on the thresholds
        ([[255, 204, 153, 51, 0]], {"mode": "scale", **BETWEEN}, [[0, 12, 38, 88, 100]]),
        ([[0, 37, 100, 101, 255]], {"mode": "raw"}, [[0, 37, 100, -1, -1]]),
        # transparent pixels are unknown
        (coloured((0, 0, 0, 255), (0, 0, 0, 254), (255, 255, 255, 0)), {"mode": "scale"}, [[100, -1, -1]]),
        # alpha is averaged with the colours: occupancies of 0.75, 0.162 and 0.412
        (coloured((0, 0, 0, 255), (200, 200, 200, 255), (200, 200, 200, 0)), {}, [[100, 0, -1]]),
        (coloured((255, 0, 0), (255, 255, 100), (255, 200, 200)), {}, [[100, -1, 0]]),
        (np.array([[0, 65535, 52428]], dtype=np.uint16), {}, [[100, 0, -1]]),
    ],
)
def test_pixels_are_cells(
    tmp_path: Path, pixels: NDArray[np.generic], changes: dict[str, object], cells: list[list[int]]
) -> None:
    grid = load_map(write_map(tmp_path, pixels, **changes))
    np.testing.assert_array_equal(grid.cells, cells)
    assert grid.resolution == 0.05
    np.testing.assert_array_equal(grid.map_from_grid, [1.0, -2.0, 0.5])


@pytest.mark.parametrize(
    "image",
    [
        b"P2\n# made by hand\n2 2 # two\n255\n0 255\n255 0\n",
        b"P1\n2 2\n1 0\n0 1\n",
        b"P5\n# sixteen bits\n2 2\n1000\n" + np.array([0, 1000, 1000, 0], dtype=">u2").tobytes(),
    ],
)
def test_pgm_of_every_kind(tmp_path: Path, image: bytes) -> None:
    yaml_path = write_map(tmp_path, [[0]], image="m.pgm")
    (tmp_path / "m.pgm").write_bytes(image)
    np.testing.assert_array_equal(load_map(yaml_path).cells, [[0, 100], [100, 0]])


def test_large_images_are_read_in_strips(tmp_path: Path) -> None:
    pixels = np.where(np.arange(700 * 3).reshape(700, 3) % 7 == 0, 0, 254).astype(np.uint8)
    cells = load_map(write_map(tmp_path, pixels)).cells
    np.testing.assert_array_equal(cells, np.where(pixels == 0, 100, 0)[::-1])


def test_pillow_warns_of_nothing(tmp_path: Path) -> None:
    yaml_path = write_map(tmp_path, [[0, 255], [255, 0]])
    picture = Image.open(tmp_path / "map.png").convert("P")
    picture.save(tmp_path / "map.png", transparency=bytes([255] * 255 + [0]))  # of which Pillow warns
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_map(str(yaml_path)).cells.shape == (2, 2)


@pytest.mark.parametrize("mode", ["1", "P", "LA"])
def test_other_kinds_of_image_read_like_grey_ones(tmp_path: Path, mode: str) -> None:
    yaml_path = write_map(tmp_path, [[0, 255], [255, 0]])
    Image.open(tmp_path / "map.png").convert(mode).save(tmp_path / "map.png")
    np.testing.assert_array_equal(load_map(yaml_path).cells, [[0, 100], [100, 0]])


def test_numbers_that_yaml_takes_for_text_are_numbers(tmp_path: Path) -> None:
    yaml_path = write_map(tmp_path, [[0]])
    yaml_path.write_text(yaml_path.read_text().replace("resolution: 0.05", "resolution: 5e-2"))
    assert load_map(yaml_path).resolution == 0.05


def test_a_folder_stands_for_its_map(tmp_path: Path) -> None:
    assert find_map(write_map(tmp_path, [[0]]).parent) == tmp_path / "map.yaml"


def test_a_shipped_map_is_found_by_name() -> None:
    for name in shipped_names():
        assert np.any(load_map(Path(name)).cells == 0)


@pytest.mark.parametrize("key", sorted(HEADER))
def test_every_missing_key_is_named(tmp_path: Path, key: str) -> None:
    with pytest.raises(UserError, match=rf"map\.yaml lacks the key {key}"):
        load_map(write_map(tmp_path, [[0]], without=key))


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"resolution": "fine"}, "resolution is 'fine'"),
        ({"resolution": 0}, "resolution is 0.0"),
        ({"resolution": -0.05}, "resolution is -0.05"),
        ({"resolution": float("nan")}, "resolution is nan"),
        ({"resolution": True}, "resolution is True"),
        ({"origin": [0, 0]}, "origin is"),
        ({"origin": 3}, "origin is 3"),
        ({"origin": [0, float("inf"), 0]}, "origin is"),
        ({"origin": [0, 0, 0, 0]}, "origin is"),
        ({"negate": 2}, "negate is 2"),
        ({"negate": "no way"}, "negate is 'no way'"),
        ({"mode": "ternary"}, "mode is 'ternary'"),
        ({"mode": []}, "mode is"),
        ({"free_thresh": 0.7}, "free_thresh is 0.7 and occupied_thresh is 0.65"),
        ({"occupied_thresh": 65}, "occupied_thresh is 65"),
        ({"image": 7}, "image is 7"),
        ({"image": "a\0b"}, "image is 'a"),
        ({"image": "\ud800.png"}, "image is '.{1,6}d800"),
        ({"image": "other.png"}, "other.png.* does not exist"),
        ({"image": "../map.png"}, "points outside its folder"),
        ({"image": "/etc/passwd"}, "points outside its folder"),
        ({"image": "map.yaml"}, "cannot be read"),
        ({"image": "."}, "does not exist"),
        ({"image": "maps/map.png"}, "does not exist; map.png lies beside it: write 'image: map.png'"),
        ({"image": "/home/other/map.png"}, "points outside its folder .*; map.png lies beside it"),
        ({"resolution": 1e-9}, "resolution is 1e-09; it must be the metres that a cell measures"),
        ({"resolution": 1e6}, "resolution is 1000000.0; it must be the metres that a cell measures"),
        ({"origin": [1e300, 0, 0]}, "origin is .1e[+]300, 0, 0.; it must be x and y in metres"),
        ({"origin": [0, 0, 90]}, "origin is .0, 0, 90.; .* yaw in radians"),
        ({"free_thresh": 0.65, "occupied_thresh": 0.196}, "free_thresh below occupied_thresh"),
        ({"negate": [[1, 2], "a\nb"]}, r"negate is \[\[1, 2\], 'a"),
    ],
)
def test_each_bad_entry_is_told(tmp_path: Path, changes: dict[str, object], complaint: str) -> None:
    with pytest.raises(UserError, match=complaint):
        load_map(write_map(tmp_path, [[0]], **changes))


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "map"
    folder.mkdir()
    yaml_path = write_map(folder, [[0]])
    (folder / "map.png").rename(tmp_path / "elsewhere.png")
    (folder / "map.png").symlink_to(tmp_path / "elsewhere.png")
    with pytest.raises(UserError, match="points outside its folder"):
        load_map(yaml_path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"just text",
        b"a: [1",
        b"\x89PNG\xff\x00",
        b"- 1\n- 2",
        b"[" * 5000,
        b"image: 2001-99-01",
        b"a: 1\na: 1",
    ],
)
def test_a_file_that_is_no_map_yaml_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "map.yaml").write_bytes(content)
    with pytest.raises(UserError, match="is not a"):
        load_map(tmp_path / "map.yaml")


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda path: path.write_bytes(b"#" * 200_001), r"is longer than the 0\.2 MB"),
        (lambda path: path.symlink_to("/dev/zero"), "There is no map at"),
        (lambda path: None, "There is no map at"),
    ],
    ids=["too long", "a device", "missing"],
)
def test_what_cannot_be_a_map_is_told(tmp_path: Path, make: Callable[[Path], object], complaint: str) -> None:
    make(tmp_path / "map.yaml")
    with pytest.raises(UserError, match=complaint):
        load_map(tmp_path / "map.yaml")


def test_a_cut_image_is_told(tmp_path: Path) -> None:
    yaml_path = write_map(tmp_path, np.zeros((300, 300), dtype=np.uint8))
    whole = (tmp_path / "map.png").read_bytes()
    (tmp_path / "map.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match=r"map\.png.* cannot be read"):
        load_map(yaml_path)


def test_an_absurd_size_is_refused_before_memory_is_spent(tmp_path: Path) -> None:
    yaml_path = write_map(tmp_path, [[0]], image="huge.pgm")
    (tmp_path / "huge.pgm").write_bytes(b"P5 100000 100000 255\n")
    with pytest.raises(UserError, match="pixels"):
        load_map(yaml_path)


@given(
    cells=arrays(
        np.int8, array_shapes(min_dims=2, max_dims=2, max_side=20), elements=st.sampled_from([-1, 0, 100])
    ),
    resolution=st.floats(1e-3, 10.0),
    origin=st.tuples(*[st.floats(-1e6, 1e6)] * 2, st.floats(-3.2, 3.2)),
)
def test_trinary_grids_come_back_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    cells: NDArray[np.int8],
    resolution: float,
    origin: tuple[float, float, float],
) -> None:
    folder = tmp_path_factory.mktemp("map")
    save_map(OccupancyGrid(cells, resolution, np.array(origin)), folder / "map.yaml")
    loaded = load_map(folder)
    np.testing.assert_array_equal(loaded.cells, cells)
    assert loaded.resolution == resolution
    np.testing.assert_array_equal(loaded.map_from_grid, origin)
    assert sorted(path.name for path in folder.iterdir()) == ["map.pgm", "map.yaml"]


GRADED = np.array([[-1, *range(50)], [-1, *range(51, 101)]], dtype=np.int8)


def trinary(occupied: int, free: int) -> NDArray[np.int8]:
    """As map_saver writes."""
    cells = np.where(occupied <= GRADED, 100, np.where(free >= GRADED, 0, -1))
    return np.where(GRADED < 0, -1, cells).astype(np.int8)


@pytest.mark.parametrize(
    ("options", "expected", "files"),
    [
        ({}, trinary(65, 19), {"map.pgm", "map.yaml"}),
        ({"occupied_threshold": 0.4, "free_threshold": 0.3}, trinary(40, 30), {"map.pgm", "map.yaml"}),
        (
            {"mode": "scale", "occupied_threshold": 0.9, "free_threshold": 0.1},
            np.where(GRADED >= 90, 100, np.where((GRADED >= 0) & (GRADED <= 10), 0, GRADED)),
            {"map_image.png", "map.yaml"},
        ),
        ({"mode": "raw"}, GRADED, {"map.pgm", "map.yaml"}),
    ],
    ids=["usual", "other thresholds", "scale", "raw"],
)
def test_cells_are_saved_as_the_mode_and_the_thresholds_say(
    tmp_path: Path, options: dict[str, Any], expected: NDArray[np.int8], files: set[str]
) -> None:
    save_map(OccupancyGrid(GRADED, 0.05, np.array([1.0, 2.0, 0.0])), tmp_path / "map.yaml", **options)
    np.testing.assert_array_equal(load_map(tmp_path).cells, expected)
    assert f"mode: {options.get('mode', 'trinary')}" in (tmp_path / "map.yaml").read_text()
    assert {path.name for path in tmp_path.iterdir()} == files


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("occupied", "free"), [(0.65, 0.196), (0.9, 0.1), (0.31, 0.3)])
def test_a_grid_as_it_is_written_is_the_one_that_is_read(
    tmp_path: Path, mode: Mode, occupied: float, free: float
) -> None:
    grid = in_tiles(OccupancyGrid(np.tile(GRADED, (300, 6)), 0.05, np.zeros(3)))
    save_map(grid, tmp_path / "map.yaml", mode=mode, occupied_threshold=occupied, free_threshold=free)
    written = as_written(grid, mode=mode, occupied_threshold=occupied, free_threshold=free)
    np.testing.assert_array_equal(written.in_one_piece().cells, load_map(tmp_path).cells)


def test_all_that_may_be_read_is_read_by_pillow_too() -> None:
    assert Image.MAX_IMAGE_PIXELS is not None
    assert MOST_PIXELS <= Image.MAX_IMAGE_PIXELS


def test_saving_where_nothing_can_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="Cannot write"):
        save_map(OccupancyGrid(np.zeros((1, 1), np.int8), 0.05, np.zeros(3)), tmp_path / "file" / "map.yaml")


@pytest.mark.skipif(not DATA.exists(), reason="needs the recordings")
def test_the_map_of_mits_basement_reads() -> None:
    grid = load_map(DATA / "racecar" / "maps" / "stata_basement.yaml")
    assert grid.cells.shape == (1300, 1730)
    assert grid.map_from_grid[2] == 3.14
    assert np.count_nonzero(grid.cells == 100) == 18_384
    assert np.count_nonzero(grid.cells == 0) == 310_278
