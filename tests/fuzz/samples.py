"""Small healthy inputs of every kind, and what is done with them."""

import json
import shutil
import sqlite3
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import yaml
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from typer.main import get_command

from racecar.mapping import Mapper, MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.bags.messages import POINT_CLOUD
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands import cli
from racecar.pipelines.files.config_file import Config, load_config
from racecar.pipelines.files.edits_file import load_edits
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import SESSION_FILE, load_session, save_session
from racecar.pipelines.live.remembered_pose import PoseMemory
from racecar.pipelines.runs.batch.bag_search import find_bags
from racecar.pipelines.runs.batch.batch_row import mapped_row
from racecar.pipelines.runs.batch.run_folders import run_folders
from racecar.pipelines.runs.mapping_job import MappingJob, is_done
from racecar.pipelines.runs.view.run_folder import load_run
from racecar.sensors.odometry import Odometry
from tests.fuzz.pages import SAID, SCREENS, page_action, sound_messages
from tests.pipelines.bag_samples import write_again
from tests.pipelines.message_samples import cloud

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

Change = Callable[[str, Any], Any]
"""Makes another message of a topic's message."""

START, STEP = 1_700_000_000_000_000_000, 100_000_000
SCANS, BEAMS = 25, 90
HALF_LENGTH, HALF_WIDTH = 4.0, 3.0
SECONDS = {"check": 10.0, "map": 30.0, "localize": 30.0}
"""Of processor time, by command: 10 and what a healthy bag of this size takes on a slow machine."""


class Link(str):
    """Where a symbolic link leads, in place of a file's content."""


@dataclass(frozen=True)
class Sample:
    """Files by their path within a folder, and an action on them that returns an exit code."""

    name: str
    files: "Mapping[str, bytes | Link]"
    action: Callable[[], int]
    damaged: tuple[str, ...]
    """Which of the files are to be damaged."""
    command: str = ""
    """That reads a bag, or ``page``; empty where something else is read."""
    weight: float = 1.0
    seconds: float = 10.0

    def write(self, folder: Path) -> None:
        """Write the files into a folder."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, Link):
                path.unlink(missing_ok=True)
                path.symlink_to(content)
            else:
                path.write_bytes(content)


def write_drive(path: Path, change: Change = lambda topic, message: message, as_cloud: bool = False) -> None:
    """A car that drives through a room: as a ROS 1 bag or a folder, its messages changed one by one."""
    with BagWriter(path) as writer:
        plain = writer.write_message

        def write_changed(topic: str, kind: str, message: Any, stamp: int) -> None:
            plain(topic, kind, change(topic, message), stamp)

        writer.write_message = write_changed  # type: ignore[method-assign]
        writer.write_static_transform(np.zeros(3))
        for index in range(SCANS):
            stamp, pose = START + index * STEP, np.array([0.1 * index - 1.0, 0.0, 0.02 * index])
            writer.write_odometry(Odometry(stamp, pose, np.array([1.0, 0.0, 0.2])))
            writer.write_transform(stamp, "odom", "base_link", pose)
            bearings = np.linspace(-2.0, 2.0, BEAMS)
            ranges = _room_ranges(pose, bearings)
            if as_cloud:
                writer.write_message("/points", POINT_CLOUD, _cloud(writer, stamp, bearings, ranges), stamp)
            else:
                step = float(bearings[1] - bearings[0])
                writer.write_scan(stamp, ranges, -2.0, step, 1e-4, 0.1, 0.1, 20.0)


def _room_ranges(pose: np.ndarray, bearings: np.ndarray) -> np.ndarray:
    """(N,) metres to the walls of a rectangular room."""
    x, y, yaw = pose
    with np.errstate(divide="ignore"):
        along = (np.sign(np.cos(bearings + yaw)) * HALF_LENGTH - x) / np.cos(bearings + yaw)
        across = (np.sign(np.sin(bearings + yaw)) * HALF_WIDTH - y) / np.sin(bearings + yaw)
    return np.minimum(along, across).astype(np.float32)


def _cloud(writer: BagWriter, stamp: int, bearings: np.ndarray, ranges: np.ndarray) -> Any:
    points = np.zeros((len(ranges), 4), dtype=np.float32)
    points[:, 0], points[:, 1] = ranges * np.cos(bearings), ranges * np.sin(bearings)
    points[:, 3] = np.linspace(0.0, 0.05, len(ranges))
    header = writer._messages._header(stamp, "laser")
    return cloud(header, ("x", "y", "z", "time"), points, writer._types.types)


def bag_action(command: str, bag: str) -> int:
    """``racecar check``, ``map`` or ``localize``, quietly."""
    flags = {
        "check": [],
        "map": ["--out", "out"],
        "localize": ["--out", "out", "--map", "room.yaml", "--initial-pose", "-1", "0", "0"],
    }
    return racecar([command, bag, "--quiet", *flags[command]])


@cache
def _command_line() -> Callable[..., object]:
    """Made once, which takes as long as a check of a small bag."""
    return get_command(cli.app)


def racecar(arguments: list[str]) -> int:
    """The command; for processes that do nothing else."""
    cli.app = _command_line()  # type: ignore[assignment]
    return cli.run(arguments)


def read_action(load: Callable[[], object]) -> int:
    """As the command line does it, without the rest of the command."""
    try:
        load()
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _read(
    name: str,
    files: "Mapping[str, bytes | Link]",
    load: Callable[[], object],
    weight: float,
    damaged: tuple[str, ...] | None = None,
) -> Sample:
    """Something that is read without a command; all of its files are damaged unless some are named."""
    return Sample(
        name, files, partial(read_action, load), tuple(files) if damaged is None else damaged, "", weight
    )


def healthy_samples(folder: Path) -> list[Sample]:
    """All of them; ``folder`` is for the work."""
    _command_line()
    room = _map_files(folder)
    bags = [(name, files) for name, files in _bags(folder).items()]
    samples = []
    for name, files in bags:
        damaged = tuple(files)
        top = next(iter(files)).split("/")[0]
        for command, weight in (("check", 6.0), ("map", 0.12), ("localize", 0.12)):
            both = {**files, **room} if command == "localize" else files
            action = partial(bag_action, command, top)
            samples.append(Sample(name, both, action, damaged, command, weight, SECONDS[command]))
    for image in ("room.pgm", "room.png"):
        files = {"room.yaml": room["room.yaml"].replace(b"room.pgm", image.encode()), image: room[image]}
        samples.append(_read(f"map {image}", files, partial(load_map, Path("room.yaml")), 8.0))
    samples.append(_session(folder))
    samples += _runs(folder, room)
    samples += [_remembered(), _edits(), _list(), *_loops(room)]
    samples.append(_config())
    samples += _trajectories()
    samples += _pages(room, (folder / "session.npz").read_bytes())
    return samples


def _bags(folder: Path) -> dict[str, dict[str, bytes]]:
    """By name; those with several files, or none of their own, are folders."""
    write_drive(folder / "plain.bag")
    write_drive(folder / "mcap")
    write_drive(folder / "cloud", as_cloud=True)
    plain, mcap = (folder / "plain.bag").read_bytes(), (folder / "mcap/mcap.mcap").read_bytes()
    bags = {
        "ros1": {"plain.bag": plain},
        "mcap": _folder(folder / "mcap"),
        "mcap alone": {"drive.mcap": mcap},
        "mcap zstd": {"drive.mcap.zstd": zstd.compress(mcap)},
        "cloud": _folder(folder / "cloud"),
    }
    for compression in Ros1Writer.CompressionFormat:
        packed = folder / f"{compression.name}.bag"
        _copy_ros1(folder / "plain.bag", packed, compression)
        bags[f"ros1 {compression.name}"] = {packed.name: packed.read_bytes()}
    for plugin, mode in [
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
        (StoragePlugin.MCAP, CompressionMode.MESSAGE),
        (StoragePlugin.SQLITE3, CompressionMode.NONE),
        (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
        (StoragePlugin.SQLITE3, CompressionMode.FILE),
    ]:
        target = folder / f"{plugin.name}_{mode.name}"
        _copy_ros2(folder / "mcap", target, plugin, mode)
        bags[target.name.lower()] = _folder(target)
    database = folder / "SQLITE3_NONE" / "SQLITE3_NONE.db3"
    bags["sqlite alone"] = {"drive.db3": database.read_bytes()}
    bags["sqlite log"] = _with_log(database, folder)
    return bags


def _folder(path: Path) -> dict[str, bytes]:
    return {f"{path.name}/{file.name}": file.read_bytes() for file in sorted(path.iterdir())}


def _copy_ros1(source: Path, target: Path, compression: Ros1Writer.CompressionFormat) -> None:
    writer = Ros1Writer(target)
    writer.set_compression(compression)
    write_again(source, writer)


def _copy_ros2(source: Path, target: Path, plugin: StoragePlugin, mode: CompressionMode) -> None:
    writer = Writer(target, version=8, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    write_again(source, writer)


def _with_log(database: Path, folder: Path) -> dict[str, bytes]:
    """The database as it is while half of its messages stand in its write-ahead log."""
    work = folder / "log"
    work.mkdir()
    shutil.copy(database, work / "log.db3")
    connection = sqlite3.connect(work / "log.db3", isolation_level=None)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA wal_autocheckpoint = 0")
    connection.execute(
        "INSERT INTO messages (topic_id, timestamp, data) "
        f"SELECT topic_id, timestamp + {SCANS * STEP}, data FROM messages"
    )
    files = {f"log/log.db3{end}": (work / f"log.db3{end}").read_bytes() for end in ("", "-wal")}
    connection.close()
    return files


def _map_files(folder: Path) -> dict[str, bytes]:
    cells = np.full((140, 180), -1, dtype=np.int8)
    cells[9:131, 9:171] = 100
    cells[10:130, 10:170] = 0
    grid = OccupancyGrid(cells, 0.05, np.array([-4.5, -3.5, 0.0]))
    save_map(grid, folder / "room.yaml")
    from PIL import Image

    Image.open(folder / "room.pgm").save(folder / "room.png")
    return {name: (folder / name).read_bytes() for name in ("room.yaml", "room.pgm", "room.png")}


def _session(folder: Path) -> Sample:
    mapper = Mapper(MappingConfig(refine=False))
    with BagReader(folder / "mcap") as reader:
        for message in reader:
            feed(message, mapper)
    save_session(mapper.finish().session, folder / "session.npz")
    files = {"session.npz": (folder / "session.npz").read_bytes()}
    return _read("session", files, partial(load_session, Path()), 12.0)


def _runs(folder: Path, room: Mapping[str, bytes]) -> list[Sample]:
    """A run's folder, as the studio and ``racecar render`` read it."""
    poses = [f"{1700000000 + 0.1 * i:.3f} {0.1 * i - 1:.4f} 0 0 0 0 0 1\n" for i in range(SCANS)]
    report = Report("racecar map")
    report.add("inputs", {"bag": "drive.bag", "bag_fingerprint": "1", "run_digest": "2", "map": "run"})
    report.add("inputs", {"part": {"start": 1.0, "duration": 5.0}, "settings": MappingConfig().model_dump()})
    report.add("counts", {"scans": SCANS, "loop_closures": 1, "path_metres": 2.5})
    report.add("result", {"path_metres": 2.5, "log_seconds": 2.4})
    segment = {"from_s": 0.5, "to_s": 1.0, "x_m": 0.0, "y_m": 0.0, "why": "It is doubtful.", "lost": False}
    report.add("quality", {"verdict": "doubtful", "reasons": ["So it is."], "segments": [segment, segment]})
    report.add("quality", {"error_per_10_m": 0.1, "error_of_whole_m": 0.2})
    report.add("accuracy", {"share_of_end_points_within_0.10_m_of_a_wall": 0.9})
    report.add("consistency", {"scan_matching": {"mean_residual_m": 0.01}})
    report.warn("Beware.")
    report.write(folder / "report.json")
    files = {
        "run/report.json": (folder / "report.json").read_bytes(),
        "run/session.npz": (folder / "session.npz").read_bytes(),
        "run/trajectory.tum": "".join(poses).encode(),
        "run/map.yaml": room["room.yaml"],
        "run/room.pgm": room["room.pgm"],
    }
    named = ("run/report.json", "run/session.npz", "run/trajectory.tum", "run/map.yaml")
    job = MappingJob(Path("drive.bag"), Path("run"), Config())
    render = partial(racecar, ["render", "run", "--out", "out", "--quiet"])
    return [
        _read("run looked at", files, partial(load_run, Path("run")), 12.0, named),
        _read("report alone", files, lambda: _seen(job), 12.0, named[:1]),
        Sample("run rendered", files, render, named[:2], weight=3.0, seconds=SECONDS["map"]),
    ]


def _seen(job: MappingJob) -> None:
    """All else that reads the report of a run."""
    json.dumps(mapped_row(job).as_dict(), default=str).encode()
    is_done(job)
    read_report(job.out).inputs.is_at_path_of(job.bag)
    run_folders([job.bag.absolute()], Path())


def _remembered() -> Sample:
    grid = OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05, np.zeros(3))
    kept = {
        "stamp": START,
        "map_from_base": [1.0, 2.0, 0.5],
        "covariance": np.eye(3).tolist(),
        "odometry_stamp": START,
        "odom_from_base": [1.0, 2.0, 0.5],
        "laser": {"base_frame": "base_link", "laser_frame": "laser", "base_from_laser": np.eye(4).tolist()},
    }
    name = PoseMemory(Path(), grid).path.name
    files = {name: json.dumps(kept).encode()}
    return _read("remembered pose", files, lambda: _carried(PoseMemory(Path(), grid)), 6.0)


def _carried(memory: PoseMemory) -> None:
    found = memory.load()
    if found is not None:
        found.carried_to(START + STEP, np.zeros(3))


def _edits() -> Sample:
    text = b"- erase: [[1, 2], [3, 2], [3, 4]]\n- wall: [[0, 0], [5, 0]]\n  width: 0.1\n"
    text += b"- speed: [[5, 0], [9, 0], [9, 3]]\n  limit: 0.5\n"
    return _read("edits", {"edits.yaml": text}, lambda: load_edits(Path("edits.yaml")).moved(np.ones(3)), 6.0)


def _list() -> Sample:
    text = b"# the drives\nmonday.bag\n'tuesday.bag'\n/no/such/folder\n"
    return _read("list", {"list.txt": text}, partial(find_bags, Path("list.txt"), Path("out")), 4.0)


def _loops(room: Mapping[str, bytes]) -> list[Sample]:
    """Links that lead to each other in place of each file that a command is given."""
    loop = {"a": Link("b"), "b": Link("a")}
    in_run = {f"run/{name}": Link(name) for name in ("report.json", "session.npz", "map.yaml", "edits.yaml")}
    track = {"run/trajectory.tum": b"1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n"}
    image = {"room.yaml": room["room.yaml"], "room.pgm": Link("room.pgm")}
    commands = [
        (["check", "a", "--quiet"], loop),
        (["map", "a", "--out", "out", "--quiet"], loop),
        (["evaluate", "a", "--reference", "b", "--quiet"], loop),
        (["render", "a", "--out", "out", "--quiet"], loop),
        (["render", "run", "--out", "out", "--quiet"], {**track, **in_run}),
        (["merge", "a", "b", "--out", "out", "--quiet"], loop),
    ]
    reads = [
        (partial(load_map, Path("a")), loop),
        (partial(load_map, Path("room.yaml")), image),
        (partial(load_config, Path("a")), loop),
        (partial(load_edits, Path("a")), loop),
        (partial(find_bags, Path("a"), Path("out")), loop),
        (partial(find_bags, Path(), Path("a")), loop),
        (partial(load_run, Path("a")), loop),
        (partial(load_run, Path("run")), {**track, **in_run}),
    ]
    return [
        *(Sample("links", files, partial(racecar, words), (), weight=0.0) for words, files in commands),
        *(_read("links", files, read, 0.0, ()) for read, files in reads),
    ]


def _config() -> Sample:
    settings = {
        "mapping": {"resolution": 0.05, "rendering": {"margin": 2.0}},
        "localization": {"particles": 2000, "slip": 0.3},
    }
    files = {"settings.yaml": yaml.safe_dump(settings).encode()}
    return _read("config", files, partial(load_config, Path("settings.yaml")), 8.0)


def _pages(room: Mapping[str, bytes], session: bytes) -> list[Sample]:
    files = {**room, f"run/{SESSION_FILE}": session, SAID: msgspec.msgpack.encode(sound_messages())}
    return [
        Sample(f"page to {kind}", files, partial(page_action, kind), (SAID,), "page", 0.5, 30.0)
        for kind in SCREENS
    ]


def _trajectories() -> list[Sample]:
    poses = [f"{1700000000 + 0.1 * i:.3f} {0.1 * i:.4f} {0.01 * i:.4f} 0 0 0 0.1 0.995\n" for i in range(60)]
    relations = [
        f"{1700000000 + 0.1 * i:.3f} {1700000001 + 0.1 * i:.3f} 1.0 0.1 0 0 0 0.02\n" for i in range(40)
    ]
    files = {"a.tum": "".join(poses).encode(), "b.tum": "".join(poses[5:]).encode()}
    against = {"a.tum": files["a.tum"], "true.relations": "".join(relations).encode()}
    evaluate = ["evaluate", "a.tum", "--quiet"]
    flags = (["--reference", "b.tum"], files), (["--relations", "true.relations"], against)
    return [
        Sample(flag[0][2:], used, partial(racecar, [*evaluate, *flag]), tuple(used), weight=4.0)
        for flag, used in flags
    ]
