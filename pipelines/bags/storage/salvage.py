"""What can still be read of a bag that ``rosbags`` refuses, and words for what is lost."""

from collections.abc import Sequence
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.chunks import ChunkedFile, Damage
from racecar.pipelines.bags.storage.mcap import MAGIC as MCAP_MAGIC
from racecar.pipelines.bags.storage.mcap import McapFile
from racecar.pipelines.bags.storage.ros1 import MAGIC as ROS1_MAGIC
from racecar.pipelines.bags.storage.ros1 import Ros1File
from racecar.pipelines.bags.storage.sqlite import MAGIC as SQLITE_MAGIC
from racecar.pipelines.bags.storage.sqlite import SqliteFile

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def file_format(path: Path) -> type[ChunkedFile]:
    """The reader for a bag file, told by its first bytes. Raises UserError when it is no bag."""
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
    if not start:
        raise UserError(f"{path} is empty: record or copy it again.")
    if start.startswith(_ZSTD_MAGIC):
        raise UserError(f"{path} is compressed: unpack it with `zstd -d`, or name the folder it belongs to.")
    for magic, reader in ((ROS1_MAGIC[:8], Ros1File), (MCAP_MAGIC, McapFile), (SQLITE_MAGIC, SqliteFile)):
        if start.startswith(magic):
            return reader
    raise UserError(
        f"{path} is not a rosbag: a ROS 1 .bag, an .mcap, a .db3 or a ROS 2 bag folder is wanted."
    )


def describe_losses(
    damages: Sequence[Damage], messages_read: int, messages_expected: int | None
) -> list[str]:
    """Sentences about what is lost; ``messages_expected`` is None where nothing tells it."""
    if not damages:
        return []
    if messages_expected:
        share = f" of {messages_expected} messages ({messages_read / messages_expected:.0%})"
    else:
        share = " messages"
    *others, last = (_describe(damage) for damage in damages)
    return [*others, f"{last} {messages_read}{share} of the bag could be read."]


def _describe(damage: Damage) -> str:
    read = damage.bytes_read / 1e6
    if damage.bytes_expected is None:
        return (
            f"{damage.file_name} {damage.cause}, after {read:.1f} MB; how much is missing it does not tell."
        )
    if damage.bytes_read >= damage.bytes_expected:
        return f"{damage.file_name} {damage.cause}."
    lost, expected = 1 - damage.bytes_read / damage.bytes_expected, damage.bytes_expected / 1e6
    return (
        f"{damage.file_name} {damage.cause}: {lost:.0%} of its bytes are lost "
        f"({read:.1f} of {expected:.1f} MB could be read)."
    )
