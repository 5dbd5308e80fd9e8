"""The bag formats, and how to recognize them.

A new format is a reader of its own and an entry in `FORMATS`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import BagFile
from racecar.pipelines.bags.storage.compression import ZSTD_MAGIC
from racecar.pipelines.bags.storage.mcap import MAGIC, McapFile
from racecar.pipelines.bags.storage.ros1 import Ros1File
from racecar.pipelines.bags.storage.sqlite import open_sqlite


@dataclass(frozen=True)
class BagFormat:
    """How to recognize and read files of a format."""

    name: str
    """Name for users."""
    magic: bytes
    """First bytes of every file."""
    suffix: str
    """Suffix of file names."""
    is_ros2: bool
    """Whether such files are in folders of ROS 2 bags."""
    open: Callable[[Path], BagFile]
    """Raises UserError when the file has an unknown version."""


FORMATS = (
    BagFormat("ROS 1 .bag", b"#ROSBAG ", ".bag", False, Ros1File),
    BagFormat(".db3", b"SQLite format 3\0", ".db3", True, open_sqlite),
    BagFormat(".mcap", MAGIC, ".mcap", True, McapFile),
)
ROS2_SUFFIXES = tuple(known.suffix for known in FORMATS if known.is_ros2)
"""Suffixes of the files in the folder of a ROS 2 bag."""
PACKED_SUFFIXES = (".zstd", ".zst")
"""Appended by rosbag2 and the program ``zstd`` to the name of a file compressed as a whole."""


def is_packed(path: Path) -> bool:
    """Whether a file is compressed as a whole. Raises UserError when it cannot be read."""
    return _start_of(path).startswith(ZSTD_MAGIC)


def file_format(path: Path) -> BagFormat:
    """The format of a bag file, from its first bytes. Raises UserError when it is not a bag."""
    start = _start_of(path)
    if not start:
        raise UserError(f"{path} is empty: record or copy it again.")
    for known in FORMATS:
        if start.startswith(known.magic):
            return known
    names = ", ".join(known.name for known in FORMATS)
    raise UserError(f"{path} is not a rosbag: give a {names} file or a ROS 2 bag folder.")


def _start_of(path: Path) -> bytes:
    if path.exists() and not path.is_file():
        raise UserError(f"{path} is neither a file nor a folder; give a rosbag.")
    try:
        with path.open("rb") as file:
            return file.read(16)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
