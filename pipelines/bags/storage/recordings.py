"""Which paths on a disk are recordings, and which of those this program wrote itself."""

import re
from contextlib import suppress
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.folder import METADATA, read_folder, read_metadata, unpacked_name
from racecar.pipelines.bags.storage.formats import FORMATS, ROS2_SUFFIXES, file_format

BAG_SUFFIXES = tuple(known.suffix for known in FORMATS)
CALLER = "/racecar"
"""Publisher named in ROS 1 bags that this program writes."""
WRITTEN_BY = {"written_by": "racecar"}
"""Custom data in the metadata.yaml of ROS 2 bags that this program writes."""
_FIRST_BYTES = 1 << 14
"""First bytes of a ROS 1 bag: its header takes 4096, the first connection with its type a few thousand."""


def is_bag_file(path: Path) -> bool:
    """Recognized by name, which also works if it is damaged, or else by its first bytes."""
    if not path.is_file():
        return False
    if unpacked_name(path).endswith(BAG_SUFFIXES):
        return True
    try:
        file_format(path)
    except UserError:
        return False
    return True


def is_bag_folder(folder: Path) -> bool:
    """Whether a folder is a single bag: rosbag2 wrote metadata.yaml, or was killed first and named the parts
    after the folder. Other bag files in a folder are separate bags."""
    try:
        bag = read_folder(folder)
    except UserError:
        return False
    endings = "|".join(re.escape(suffix) for suffix in ROS2_SUFFIXES)
    part = re.compile(rf"{re.escape(folder.name)}(_\d+)?({endings})(\.zstd|\.zst)?")
    return (folder / METADATA).is_file() or all(part.fullmatch(file.name) for file in bag.files)


def is_our_recording(path: Path) -> bool:
    """Whether this program wrote a bag, as stated in the bag."""
    if path.is_dir():
        custom = read_metadata(path / METADATA).get("custom_data")
        return isinstance(custom, dict) and custom.items() >= WRITTEN_BY.items()
    with suppress(OSError), path.open("rb") as file:
        return f"callerid={CALLER}".encode() in file.read(_FIRST_BYTES)
    return False


def refuse_lone_part(path: Path) -> None:
    """Raises UserError when the name of a bag to be written is that of a single file of a ROS 2 bag."""
    if path.suffix in ROS2_SUFFIXES or path.name == METADATA:
        raise UserError(f"{path} cannot be written as a single file: name a .bag file, or a folder.")
