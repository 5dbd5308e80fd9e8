"""The bag formats, and which of their readers a file is for.

Another format is a reader of its own and a line in `FORMATS`.
"""

from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import ChunkedFile
from racecar.pipelines.bags.storage.mcap import McapFile
from racecar.pipelines.bags.storage.ros1 import Ros1File
from racecar.pipelines.bags.storage.sqlite import SqliteFile

FORMATS: tuple[type[ChunkedFile], ...] = (Ros1File, SqliteFile, McapFile)
ROS2_SUFFIXES = tuple(reader.suffix for reader in FORMATS if reader.is_ros2)
"""Of the files that lie in the folder of a ROS 2 bag."""

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""Of a file compressed as a whole; RFC 8878, 3.1.1."""


def file_format(path: Path) -> type[ChunkedFile]:
    """The reader for a bag file, found by its first bytes. Raises UserError when it is no bag."""
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
    if not start:
        raise UserError(f"{path} is empty: record or copy it again.")
    if start.startswith(_ZSTD_MAGIC):
        raise UserError(f"{path} is compressed: unpack it with `zstd -d`, or name the folder it belongs to.")
    for reader in FORMATS:
        if start.startswith(reader.magic):
            return reader
    names = ", ".join(reader.name for reader in FORMATS)
    raise UserError(f"{path} is not a rosbag: give a {names} file or a ROS 2 bag folder.")
