"""Small bags for the tests: a car that drives straight and looks at a wall all around it."""

import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.messages import OLD_TRANSFORMS, TRANSFORMS
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.writer import BagWriter
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

START = 1_700_000_000_000_000_000
STEP = 25_000_000
PLACE = np.array([0.25, 0.1, 0.5])
BEAMS = 181
INCREMENT = np.radians(1.0)


def header(types: dict[str, Any], stamp: int = 0, frame: str = "laser", **more: Any) -> Any:
    """Of a message of these types, stamped in nanoseconds."""
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
    return types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **more)


def odometry(index: int, **changes: Any) -> Odometry:
    values = {
        "stamp": START + index * STEP,
        "odom_from_base": np.array([0.02 * index, 0.0, 0.001 * index]),
        "twist": np.array([0.8, 0.0, 0.04]),
    }
    return Odometry(**{**values, **changes})


def write_scan(writer: BagWriter, index: int, **changes: Any) -> None:
    values = {
        "stamp_ns": START + index * STEP,
        "ranges": np.full(BEAMS, 2.0 + index * 1e-3, dtype=np.float32),
        "angle_min": -np.pi / 2,
        "angle_increment": INCREMENT,
        "time_increment": 1e-4,
        "scan_time": 0.025,
        "range_min": 0.1,
        "range_max": 30.0,
    }
    writer.write_scan(**{**values, **changes})


def as_usual(_: int) -> dict[str, Any]:
    return {}


def write_bag(
    path: Path,
    indices: int | Iterable[int] = 200,
    with_odometry: bool = True,
    *,
    place: Pose | None = PLACE,
    wheels: Callable[[int], dict[str, Any] | None] = as_usual,
    scans: Callable[[int], dict[str, Any] | None] = as_usual,
) -> Path:
    """A bag whose odometry and scans at some indices, or so many, are changed by what is said of each index;
    at None there is none."""
    with BagWriter(path) as writer:
        if place is not None:
            writer.write_static_transform(place)
        for index in range(indices) if isinstance(indices, int) else indices:
            if with_odometry and (changes := wheels(index)) is not None:
                writer.write_odometry(odometry(index, **changes))
            if (changes := scans(index)) is not None:
                write_scan(writer, index, **changes)
    return path


def write_links(writer: BagWriter, index: int, *links: Any, topic: str = "/tf", old: bool = False) -> None:
    """A message of transforms: parent, child and pose (3,) or transform message each."""
    stamp = START + index * STEP
    message = writer._messages.transform(stamp, "", "", np.zeros(3))
    message.transforms.clear()
    for parent, child, pose in links:
        message.transforms += writer._messages.transform(stamp, parent, child, pose).transforms
    writer.write_message(topic, OLD_TRANSFORMS if old else TRANSFORMS, message, stamp)


def bag_of(path: Path, write: Callable[[BagWriter], None]) -> Path:
    with BagWriter(path) as writer:
        write(writer)
    return path


def write_again(source: Path, writer: Any) -> Path:
    """The messages of a bag, by a writer of rosbags for the same kind of ROS."""
    is_ros1 = source.suffix == ".bag"
    with (Ros1Reader if is_ros1 else Ros2Reader)(source) as reader, writer:
        connections = {}
        for each in reader.connections:
            digest = {"md5sum": each.digest} if is_ros1 else {"rihs01": "RIHS01_" + "0" * 64}
            connections[each.id] = writer.add_connection(
                each.topic, each.msgtype, msgdef=each.msgdef.data, **digest
            )
        for connection, time, data in reader.messages():
            writer.write(connections[connection.id], time, data)
    return Path(writer.path)


def as_sqlite(source: Path, target: Path) -> Path:
    """The same bag in a sqlite folder."""
    return write_again(source, Ros2Writer(target, version=8, storage_plugin=StoragePlugin.SQLITE3))


def cut(source: Path, target: Path, share: float) -> Path:
    """A copy of the first bytes of a file."""
    with source.open("rb") as whole:
        target.write_bytes(whole.read(int(source.stat().st_size * share)))
    return target


def cut_folder(source: Path, target: Path, share: float, with_metadata: bool = True) -> Path:
    """A copy of a bag folder with its bag file cut."""
    target.mkdir()
    for file in source.iterdir():
        if file.name != "metadata.yaml":
            cut(file, target / file.name, share)
        elif with_metadata:
            shutil.copy(file, target)
    return target


def read(path: Path, **options: Any) -> tuple[list[Scan], list[Odometry], BagReader]:
    """Everything in a bag; the reader is closed and still tells its counts."""
    scans, samples = [], []
    with BagReader(path, **options) as reader:
        for item in reader:
            if isinstance(item, Scan):
                scans.append(item)
            else:
                samples.append(item)
    return scans, samples, reader


def bags_of_all_formats(folder: Path, count: int) -> dict[str, Path]:
    """One drive as a ROS 1 bag and as folders of MCAP and of SQLite."""
    mcap = write_bag(folder / "drive", count)
    return {
        "ros1": write_bag(folder / "drive.bag", count),
        "mcap": mcap,
        "sqlite": as_sqlite(mcap, folder / "other"),
    }


def file_of(bag: Path) -> Path:
    """The file of a bag that is one, or that has one in its folder."""
    return bag if bag.is_file() else next(file for file in bag.iterdir() if file.suffix in (".mcap", ".db3"))


def numbers_of(name, reader):
    """The numbers of the one finding of a bag with this name, which has some."""
    (finding,) = [finding for finding in reader.findings if finding.name == name]
    assert finding.numbers
    return finding.numbers
