"""Which files make up a bag, in which order, and whether two paths contain the same bag."""

import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.whole_folders import finish_replacing
from racecar.maps.yaml_text import UnreadableYamlError, parse_yaml
from racecar.pipelines.bags.storage.formats import FORMATS, PACKED_SUFFIXES, ROS2_SUFFIXES

METADATA = "metadata.yaml"
_MOST_BYTES = 1 << 20
"""Limit on metadata.yaml; hundreds of topics take less, and parsing more takes long."""
_PIECE = 1 << 20
"""Bytes at either end of a file that distinguish bags, so a large bag costs no more than a small one. The
stamps in them differ between any two drives, and file sizes are compared too."""


@dataclass
class BagFolder:
    """The files of a bag, and the information in metadata.yaml if it is present and valid."""

    files: list[Path]
    message_count: int | None = None
    """As announced by metadata.yaml."""
    missing: list[str] = field(default_factory=list)
    """Names in metadata.yaml without a file."""
    unnamed: list[Path] = field(default_factory=list)
    """Files missing from metadata.yaml; they are further parts of the recording."""
    others: list[Path] = field(default_factory=list)
    """Bag files in the folder that do not belong to the recording described by metadata.yaml."""


def read_folder(folder: Path) -> BagFolder:
    """Find the files of a bag. Raises UserError when the folder has no bag or cannot be read."""
    finish_replacing(folder)
    try:
        present = sorted((path for path in folder.iterdir() if path.is_file()), key=natural_order)
    except OSError as error:
        raise UserError(f"{folder} cannot be read: {error.strerror}.") from error
    bag_files = [path for path in present if unpacked_name(path).endswith(ROS2_SUFFIXES)]
    # A file that was unpacked manually is next to the packed one.
    bag_files = [
        path for path in bag_files if path.suffix not in PACKED_SUFFIXES or _twin(path) not in bag_files
    ]
    if not bag_files:
        raise UserError(_no_bag(folder, present))
    metadata = read_metadata(folder / METADATA)
    count = metadata.get("message_count")
    bag = BagFolder(bag_files, count if isinstance(count, int) and count > 0 else None)
    named = _named_files(metadata)
    found = [path for path in bag_files if {path.name, unpacked_name(path)} & set(named)]
    if not found:
        return bag
    names = {name for path in found for name in (path.name, unpacked_name(path))}
    bag.missing = [name for name in named if not {name, unpacked_name(Path(name))} & names]
    recordings = {_recording(path) for path in found}
    bag.unnamed = [path for path in bag_files if path not in found and _recording(path) in recordings]
    bag.files = [path for path in bag_files if path in found or path in bag.unnamed]
    bag.others = [path for path in bag_files if path not in bag.files]
    return bag


def bag_fingerprint(bag: Path) -> str:
    """Digest of the size and both ends of each file of a bag; the same wherever it is moved or copied.

    Raises UserError when it is not a bag.
    """
    digest = hashlib.sha256()
    for path in read_folder(bag).files if bag.is_dir() else [bag]:
        size = path.stat().st_size
        digest.update(size.to_bytes(8, "big"))
        with path.open("rb") as file:
            digest.update(file.read(_PIECE))
            file.seek(max(size - _PIECE, 0))
            digest.update(file.read(_PIECE))
    return digest.hexdigest()


def read_metadata(path: Path) -> dict[str, Any]:
    """Content of metadata.yaml; empty if it is missing or invalid."""
    try:
        content = parse_yaml(read_text(path, _MOST_BYTES))
    except (UserError, UnreadableYamlError):
        return {}
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    return information if isinstance(information, dict) else {}


def _named_files(metadata: dict[str, Any]) -> list[str]:
    """Names of the files, without the folders they were in while being recorded."""
    paths = metadata.get("relative_file_paths")
    if not isinstance(paths, list):
        return []
    return [Path(path).name for path in paths if isinstance(path, str) and "\0" not in path]


def unpacked_name(path: Path) -> str:
    """Name without the suffixes of compression and of a ROS 1 bag that is still being recorded."""
    name = path.name
    for suffix in (*PACKED_SUFFIXES, ".active"):
        name = name.removesuffix(suffix)
    return name


def _twin(path: Path) -> Path:
    return path.with_name(unpacked_name(path))


def _recording(path: Path) -> tuple[str, str]:
    """What the parts of a split recording share; rosbag2 numbers them, as in ``drive_0.mcap``."""
    name = Path(unpacked_name(path))
    return re.sub(r"_\d+$", "", name.stem), name.suffix


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Sort key in which digits in names compare as numbers."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdecimal() and len(part) < 20 else (-1, part) for part in parts]


def _no_bag(folder: Path, present: list[Path]) -> str:
    ros1_suffixes = tuple(known.suffix for known in FORMATS if not known.is_ros2)
    ros1_bags = [path.name for path in present if path.name.endswith(ros1_suffixes)]
    if ros1_bags:
        return f"{folder} is a folder of ROS 1 bags: name one of them ({', '.join(ros1_bags[:5])})."
    if (folder / "map.yaml") in present:
        return f"{folder} holds a map, not a bag: name the bag first, then the map."
    return f"{folder} holds no bag: neither {' nor '.join(ROS2_SUFFIXES)} files are in it."
