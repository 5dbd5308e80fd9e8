"""The bag formats, and which of their readers a file is for.

Another format is a reader of its own and a line in `FORMATS`.
"""

from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import BagFile
from racecar.pipelines.bags.storage.compression import ZSTD_MAGIC
from racecar.pipelines.bags.storage.mcap import McapFile
from racecar.pipelines.bags.storage.ros1 import Ros1File
from racecar.pipelines.bags.storage.sqlite import SqliteFile

FORMATS: tuple[type[BagFile], ...] = (Ros1File, SqliteFile, McapFile)
ROS2_SUFFIXES = tuple(reader.suffix for reader in FORMATS if reader.is_ros2)
"""Of the files that lie in the folder of a ROS 2 bag."""
PACKED_SUFFIXES = (".zstd", ".zst")
"""Which rosbag2 and the program ``zstd`` append to the name of a file compressed as a whole."""


def is_packed(path: Path) -> bool:
    """Whether a file is compressed as a whole. Raises UserError when it cannot be read."""
    return _start_of(path).startswith(ZSTD_MAGIC)


def file_format(path: Path) -> type[BagFile]:
    """The reader for a bag file, found by its first bytes. Raises UserError when it is no bag."""
    start = _start_of(path)
    if not start:
        raise UserError(f"{path} is empty: record or copy it again.")
    for reader in FORMATS:
        if start.startswith(reader.magic):
            return reader
    names = ", ".join(reader.name for reader in FORMATS)
    raise UserError(f"{path} is not a rosbag: give a {names} file or a ROS 2 bag folder.")


def _start_of(path: Path) -> bytes:
    if path.exists() and not path.is_file():
        raise UserError(f"{path} is neither a file nor a folder; give a rosbag.")
    try:
        with path.open("rb") as file:
            return file.read(16)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
