"""Map files of ROS map_server and nav2: a YAML file and an image.

Pixels are read as in nav2_map_server's ``map_io.cpp``: the brightness of a pixel is the mean of its colour
channels, and darker is more occupied (the reverse with ``negate``). The modes are ``trinary`` (occupied,
free, unknown), ``scale`` (graded between the thresholds; transparent is unknown) and ``raw`` (the brightness,
0 to 100, is the percentage itself).
"""

import math
import os
import reprlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image

from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import (
    FREE,
    FREE_THRESHOLD,
    OCCUPIED,
    OCCUPIED_THRESHOLD,
    UNKNOWN,
    OccupancyGrid,
)
from racecar.maps.grid.raster import Raster
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.maps.image_files import BLACK, GREY, WHITE, write_pgm, write_png
from racecar.maps.shipped import shipped_map, shipped_names
from racecar.maps.text_files import read_text
from racecar.maps.whole_files import write_atomically
from racecar.maps.whole_folders import finish_replacing
from racecar.maps.yaml_text import MOST_BYTES, UnreadableYamlError, parse_yaml

Mode = Literal["trinary", "scale", "raw"]
MODES: tuple[Mode, ...] = get_args(Mode)
_IMAGE_ENDS: dict[Mode, str] = {"trinary": ".pgm", "scale": "_image.png", "raw": ".pgm"}
"""Image name after that of its YAML file; not ``.png``, since ``map.png`` also shows the path."""
MOST_PIXELS = 9000 * 9000
"""Most pixels of an image, since a small file may claim any size: in colour these take 0.4 GB."""
IMAGE_FORMATS = ("PPM", "PNG", "BMP", "JPEG", "TIFF", "GIF")

_FINEST, _COARSEST = 0.001, 10.0
"""Metres per cell. Lasers of small cars err by a centimetre, and a car is lost in a cell larger than a room:
a resolution outside this range has the wrong unit."""
_FARTHEST_ORIGIN = 1e8
"""Metres. No map's coordinates are larger, since the earth's circumference is 4e7."""
_MOST_YAW = 6.3
"""Radians, slightly more than a full turn; larger values were meant as degrees."""
_STRIP = 256
"""Image rows processed at a time, because NumPy takes eight bytes per pixel and large grids are stored as
tiles."""


@dataclass(frozen=True)
class _Header:
    """Contents of the YAML file."""

    image: Path
    resolution: float
    origin: NDArray[np.float64]
    negate: bool
    occupied_threshold: float
    free_threshold: float
    mode: str


def find_map(path: str | Path) -> Path:
    """The YAML file that a path means: itself, ``map.yaml`` in a folder, or a shipped map by name."""
    path = Path(path)
    finish_replacing(path)
    if path.is_dir():
        path = path / "map.yaml"
    if path.is_file():
        return path
    if str(path) in shipped_names():
        return shipped_map(str(path))
    raise UserError(
        f"There is no map at {path}: give a map's YAML file, a folder that holds a map.yaml, "
        f"or the name of a shipped map ({', '.join(shipped_names())})."
    )


@checked
def load_map(path: str | Path) -> OccupancyGrid:
    """Load the grid of a map's YAML file, of a folder's ``map.yaml``, or of a shipped map by name.

    Raises UserError for anything that is wrong with the two files.
    """
    yaml_path = find_map(path)
    header = _read_header(yaml_path)
    return OccupancyGrid(_read_cells(header, yaml_path), header.resolution, header.origin)


def image_of_map(yaml_path: Path) -> Path:
    """The image named in a map's YAML file. Raises UserError when the file is no such YAML."""
    return _read_header(yaml_path).image


@checked
def save_map(
    grid: Raster,
    yaml_path: str | Path,
    *,
    mode: Mode = "trinary",
    occupied_threshold: float = OCCUPIED_THRESHOLD,
    free_threshold: float = FREE_THRESHOLD,
) -> None:
    """Write an image, then the YAML file that names it; each is written to a temporary file and renamed.

    Cells at or above one probability are occupied, up to the other free. In ``trinary`` mode, cells between
    become unknown, as with map_saver. ``scale`` keeps their percentage; its image is a PNG, since only
    transparent pixels are unknown there. ``raw`` keeps every cell as it is. Readers get what was written.
    """
    if mode not in MODES:
        raise UserError(
            f"There is no mode {_short(mode)} of a map file; it must be one of {', '.join(MODES)}."
        )
    yaml_path = Path(yaml_path)
    image_path = yaml_path.with_name(yaml_path.stem + _IMAGE_ENDS[mode])
    header = {
        "image": image_path.name,
        "mode": mode,
        "resolution": float(grid.resolution),
        "origin": [float(value) for value in grid.map_from_grid],
        "negate": 0,
        "occupied_thresh": OCCUPIED_THRESHOLD,
        "free_thresh": FREE_THRESHOLD,
    }
    save_map_image(
        grid, image_path, mode=mode, occupied_threshold=occupied_threshold, free_threshold=free_threshold
    )
    with write_atomically(yaml_path) as beside:
        beside.write_text(yaml.safe_dump(header, sort_keys=False, default_flow_style=None), encoding="utf-8")


def save_map_image(
    grid: Raster, path: Path, *, mode: Mode, occupied_threshold: float, free_threshold: float
) -> None:
    """Write only the image of `save_map`, top row farthest along y: a PNG or a PGM, by its name."""
    pixels = _pixel_of_cell(mode, occupied_threshold, free_threshold)
    strips = (
        pixels[grid.rows(max(0, until - _STRIP), until)[::-1].astype(np.int16) - UNKNOWN]
        for until in range(grid.shape[0], 0, -_STRIP)
    )
    with write_atomically(path) as beside, beside.open("wb") as file:
        write = write_png if path.suffix == ".png" else write_pgm
        write(strips, grid.shape, file)


def as_written(grid: TiledGrid, *, mode: Mode, occupied_threshold: float, free_threshold: float) -> TiledGrid:
    """The grid that a reader of the files of `save_map` gets."""
    pixels = _pixel_of_cell(mode, occupied_threshold, free_threshold)
    image = Image.fromarray(pixels[None], mode="LA" if mode == "scale" else "L")
    header = _Header(Path(), 1.0, np.zeros(3), False, OCCUPIED_THRESHOLD, FREE_THRESHOLD, mode)
    read = _cells_of(image, header)[0]
    tiles = {tile: read[cells.astype(np.int16) - UNKNOWN] for tile, cells in grid.tiles.items()}
    return replace(grid, tiles=tiles)


def _pixel_of_cell(mode: Mode, occupied_threshold: float, free_threshold: float) -> NDArray[np.uint8]:
    """(102,), or with opacity (102, 2), pixels: first the unknown cell's, then one per percentage."""
    percent = np.arange(UNKNOWN, OCCUPIED + 1)
    is_unknown = percent == UNKNOWN
    if mode == "raw":
        return np.where(is_unknown, 255, percent).astype(np.uint8)
    is_free = ~is_unknown & (percent <= 100 * free_threshold)
    is_occupied = percent >= 100 * occupied_threshold
    if mode == "trinary":
        return np.select([is_free, is_occupied], [WHITE, BLACK], GREY).astype(np.uint8)
    share = np.maximum(percent, 0) / OCCUPIED
    shade = np.rint(255 * (1.0 - FREE_THRESHOLD - share * (OCCUPIED_THRESHOLD - FREE_THRESHOLD)))
    grey = np.select([is_free, is_occupied], [WHITE, BLACK], shade)
    return np.column_stack([grey, np.where(is_unknown, 0, 255)]).astype(np.uint8)


def _read_header(yaml_path: Path) -> _Header:
    entries = _read_yaml(yaml_path)
    mode = entries.get("mode", "trinary")
    if mode not in MODES:
        raise UserError(f"In {yaml_path}, mode is {_short(mode)}; it must be one of {', '.join(MODES)}.")
    resolution = _number(entries, "resolution", yaml_path)
    if not _FINEST <= resolution <= _COARSEST:
        raise UserError(
            f"In {yaml_path}, resolution is {resolution}; it must be the metres that a cell measures, "
            f"{_FINEST:g} to {_COARSEST:g}, such as 0.05."
        )
    occupied = _number(entries, "occupied_thresh", yaml_path)
    free = _number(entries, "free_thresh", yaml_path)
    if not 0 <= free < occupied <= 1:
        raise UserError(
            f"In {yaml_path}, free_thresh is {free} and occupied_thresh is {occupied}; "
            "they must lie between 0 and 1, free_thresh below occupied_thresh."
        )
    return _Header(
        image=_image_path(entries, yaml_path),
        resolution=resolution,
        origin=_origin(entries, yaml_path),
        negate=_negate(entries, yaml_path),
        occupied_threshold=occupied,
        free_threshold=free,
        mode=mode,
    )


def _read_yaml(yaml_path: Path) -> dict[str, Any]:
    try:
        entries = parse_yaml(read_text(yaml_path, MOST_BYTES))
    except UnreadableYamlError as error:
        raise UserError(
            f"{yaml_path} is not a YAML file of a map, as {error}; give the YAML file, not its image."
        ) from error
    if not isinstance(entries, dict):
        raise UserError(
            f"{yaml_path} is not a map's YAML file: it holds no keys such as image and resolution."
        )
    return entries


def _entry(entries: dict[str, Any], key: str, yaml_path: Path) -> Any:
    if entries.get(key) is None:
        raise UserError(f"{yaml_path} lacks the key {key}, which every ROS map file has; add it.")
    return entries[key]


def _short(value: Any) -> str:
    """Format any value on one line of a message."""
    short = reprlib.Repr()
    short.maxstring = short.maxother = 120
    return " ".join(short.repr(value).split())


def _number(entries: dict[str, Any], key: str, yaml_path: Path) -> float:
    value = _entry(entries, key, yaml_path)
    number = _as_number(value)
    if number is None:
        raise UserError(f"In {yaml_path}, {key} is {_short(value)}; it must be a finite number.")
    return number


def _as_number(value: Any) -> float | None:
    """A finite number, also one that YAML 1.1 reads as text (5e-2); None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _origin(entries: dict[str, Any], yaml_path: Path) -> NDArray[np.float64]:
    value = _entry(entries, "origin", yaml_path)
    numbers = [_as_number(number) for number in value] if isinstance(value, list) else []
    origin = np.array([number for number in numbers if number is not None])
    if len(numbers) != 3 or len(origin) != 3:
        raise UserError(
            f"In {yaml_path}, origin is {_short(value)}; it must be three finite numbers [x, y, yaw]."
        )
    if np.abs(origin[:2]).max() > _FARTHEST_ORIGIN or abs(origin[2]) > _MOST_YAW:
        raise UserError(
            f"In {yaml_path}, origin is {_short(value)}; it must be x and y in metres, "
            f"{_FARTHEST_ORIGIN:g} at most, and yaw in radians, a turn at most."
        )
    return origin


def _negate(entries: dict[str, Any], yaml_path: Path) -> bool:
    value = _entry(entries, "negate", yaml_path)
    if value not in (0, 1):
        raise UserError(f"In {yaml_path}, negate is {_short(value)}; it must be 0 or 1.")
    return bool(value)


def _image_path(entries: dict[str, Any], yaml_path: Path) -> Path:
    """The image's path, confined to the YAML file's folder: maps must not read other files."""
    name = _entry(entries, "image", yaml_path)
    if not isinstance(name, str) or not name or not _can_be_a_name(name):
        raise UserError(
            f"In {yaml_path}, image is {_short(name)}; it must be the name of an image beside it."
        )
    image_path, beside = yaml_path.parent / name, yaml_path.parent / Path(name).name
    is_other = beside != image_path and beside.is_file()
    instead = f"{beside.name} lies beside it: write 'image: {beside.name}' if that is the one"
    if not Path(os.path.realpath(image_path)).is_relative_to(os.path.realpath(yaml_path.parent)):
        remedy = instead if is_other else "put the image beside the YAML file and name it without a path"
        raise UserError(f"In {yaml_path}, image points outside its folder ({_short(name)}); {remedy}.")
    if not image_path.is_file():
        remedy = instead if is_other else "put it there"
        raise UserError(f"The image {image_path}, named in {yaml_path}, does not exist; {remedy}.")
    return image_path


def _can_be_a_name(text: str) -> bool:
    """Whether a text is a valid file name; YAML escapes may hold half a surrogate pair."""
    try:
        return b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:
        return False


def _read_cells(header: _Header, yaml_path: Path) -> NDArray[np.int8]:
    """(rows, columns) cells of the image, lowest row first."""
    called = f"The image {header.image}, named in {yaml_path},"
    image = open_image(header.image, called)
    cells = np.empty((image.height, image.width), dtype=np.int8)
    try:
        with _silence():
            for top in range(0, image.height, _STRIP):
                strip = image.crop((0, top, image.width, min(top + _STRIP, image.height)))
                cells[image.height - top - strip.height : image.height - top] = _cells_of(strip, header)[::-1]
    except MemoryError:
        raise
    except Exception as error:  # same causes as for opening it
        raise _unreadable(called, error) from error
    return cells


def _cells_of(image: Image.Image, header: _Header) -> NDArray[np.int8]:
    """(rows, columns) cells of an image, highest row first."""
    brightness, full, transparent = _brightness(image, header.mode)
    cells = _percent_of_brightness(header, full)[brightness]
    if header.mode == "scale":
        cells[transparent] = UNKNOWN
    return cells


def _brightness(image: Image.Image, mode: str) -> tuple[NDArray[np.uint16], int, NDArray[np.bool_]]:
    """Channel sums (rows, columns) of an image, the sum of a white pixel, and which pixels are not opaque.

    Sums are integers, so equal pixels fall on the same side of a threshold in every image format. As in nav2,
    alpha counts as a fourth channel in trinary mode only.
    """
    if image.mode.startswith("I"):
        grey = np.clip(np.asarray(image), 0, 65535).astype(np.uint16)
        return grey, 65535, np.zeros(grey.shape, dtype=np.bool_)
    if "A" in image.getbands() or "transparency" in image.info:
        pixels = np.asarray(image.convert("RGBA"))
        transparent = pixels[..., 3] < 255
        channels = pixels if mode == "trinary" else pixels[..., :3]
    else:
        channels = np.atleast_3d(np.asarray(image.convert("L" if image.mode in ("1", "L") else "RGB")))
        transparent = np.zeros(channels.shape[:2], dtype=np.bool_)
    return channels.sum(axis=2, dtype=np.uint16), 255 * channels.shape[2], transparent


def open_image(path: Path, called: str) -> Image.Image:
    """Open and decode an image, whose name in sentences is ``called``. Raises UserError when it cannot be
    read, or is too large."""
    try:
        with _silence():
            image = Image.open(path, formats=IMAGE_FORMATS)
            if image.width * image.height > MOST_PIXELS:
                raise Image.DecompressionBombError
            image.load()
    except Image.DecompressionBombError as error:
        raise UserError(
            f"{called} has more than {MOST_PIXELS} pixels; crop it or save it at a coarser resolution."
        ) from error
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise arbitrary exceptions.
        raise _unreadable(called, error) from error
    return image


def _unreadable(called: str, error: Exception) -> UserError:
    reason = " ".join(str(error).split())
    return UserError(
        f"{called} cannot be read ({reason}); it must be a whole image of one of the kinds "
        f"{', '.join(IMAGE_FORMATS)}."
    )


@contextmanager
def _silence() -> Iterator[None]:
    """Silence Pillow's warnings about files that it can read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _percent_of_brightness(header: _Header, full: int) -> NDArray[np.int8]:
    """(full + 1,) cell value of each brightness."""
    shade = np.arange(full + 1) / full
    occupancy = shade if header.negate else np.arange(full, -1, -1) / full
    if header.mode == "raw":
        percent = np.rint(shade * 255)
        return np.where(percent <= OCCUPIED, percent, UNKNOWN).astype(np.int8)
    if header.mode == "scale":
        span = header.occupied_threshold - header.free_threshold
        between = np.rint((occupancy - header.free_threshold) / span * OCCUPIED)
    else:
        between = np.full(full + 1, float(UNKNOWN))
    conditions = [occupancy > header.occupied_threshold, occupancy < header.free_threshold]
    return np.select(conditions, [OCCUPIED, FREE], between).astype(np.int8)
