"""How fast, how well and at what cost the nodes run while another process plays a bag."""

import os
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from json import loads
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.live.node_listener import NodeListener, listening
from benchmarks.live.played_drives import PlayedDrive, recorded_drive, simulated_drive
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.warm_up import warm_up
from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.map_files import load_map
from racecar.maps.sensing.scan import Scan
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.evaluation.evaluation import compare
from racecar.pipelines.evaluation.wall_fit import WallFit
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report, resident_memory_mb
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.ros.processes import private_environment, racecar_process
from racecar.pipelines.runs.mapping_run import build_map

_DOMAINS = range(30, 100)
"""Of ROS: numbers that others on the machine hardly use."""
_READY_SECONDS = 120.0
"""A node compiles its kernels when it starts for the first time, which takes about a minute."""
_MEMORY_EVERY = 1.0
"""Seconds between two looks at a node's memory."""


@dataclass
class LiveFigures:
    """The figures of one node on one drive; None where one does not apply."""

    drive: str
    node: str
    scans: int = 0
    odometry: int = 0
    received: int = 0
    posed: int = 0
    pose_messages: int = 0
    latency_ms: dict[str, float] = field(default_factory=dict)
    latency_ms_by_tenth: list[float] = field(default_factory=list)
    """Medians, in the order of the drive."""
    seen_latency_ms: dict[str, float] = field(default_factory=dict)
    """From where another process receives a scan to where it receives its pose."""
    memory_mb_by_tenth: list[float] = field(default_factory=list)
    """Medians of what the node's process held, in the order of the drive."""
    peak_memory_mb: float = 0.0
    """The most it ever held, also while it saved a map."""
    cpu_share: float = 0.0
    stolen_share: float = 0.0
    """Of a core, given to other virtual machines on the same host while the drive was played; scans wait."""
    error_live_m: float | None = None
    error_offline_m: float | None = None
    on_walls_live: float | None = None
    on_walls_offline: float | None = None
    longest_backlog_s: float | None = None
    from_offline_map_m: float | None = None
    faults: dict[str, int] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For report.json."""
        return asdict(self)


def measure_drives(
    seconds: float,
    recordings: Path | None,
    settings: Config,
    *,
    seed: int,
    speed: float,
    nodes: Sequence[str],
    announce: Callable[[str], None],
) -> list[LiveFigures]:
    """The figures of the ``nodes`` (localizer, mapper) on a simulated drive and, if there is one, a recorded
    one. Raises UserError when a node does not start."""
    domain = _DOMAINS[os.getpid() % len(_DOMAINS)]
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        drives = [simulated_drive(Path(folder), seconds, seed)]
        session = recorded_drive(recordings) if recordings else None
        for drive in [*drives, session] if session else drives:
            if "localizer" in nodes:
                announce(f"Playing {drive.name} to the localizer")
                figures.append(measure_localizer(drive, settings.localization, domain, speed))
            if "mapper" in nodes:
                announce(f"Playing {drive.name} to the mapper")
                figures.append(measure_mapper(drive, settings.mapping, domain, speed))
    return figures


def measure_localizer(
    drive: PlayedDrive, config: LocalizationConfig, domain: int, speed: float
) -> LiveFigures:
    """Replay a drive offline, then play it to the node, ``speed`` times as fast, from the same start."""
    warm_up(LocalizationConfig())
    with BagReader(drive.bag) as reader:
        figures = LiveFigures(drive.name, "localizer")
        figures.scans = reader.topics[reader.scan_topic].message_count
        figures.odometry = reader.topics[reader.odom_topic].message_count if reader.odom_topic else 0
        start = _find_start(reader, drive, config)
        offline = _localize_offline(reader, drive, config, start)
        pose = [f"{value:.6f}" for value in start]
        arguments = ["live", "localize", "--map", str(drive.map), "--no-memory", "--initial-pose", *pose]
        summary, heard = _run(arguments, drive, reader.odom_topic, domain, speed)
        live = heard.trajectory()
        _take_summary(figures, summary)
        figures.posed, figures.pose_messages = len(live), heard.pose_messages
        figures.seen_latency_ms = heard.latency_ms()
        if drive.truth is not None:
            figures.error_live_m = _mean_error(live, drive.truth)
            figures.error_offline_m = _mean_error(offline, drive.truth)
        figures.on_walls_live = _share_on_walls(reader, live, drive)
        figures.on_walls_offline = _share_on_walls(reader, offline, drive)
    return figures


def measure_mapper(drive: PlayedDrive, config: MappingConfig, domain: int, speed: float) -> LiveFigures:
    """Map a drive offline, then play it to the node, ``speed`` times as fast."""
    with BagReader(drive.bag) as reader, tempfile.TemporaryDirectory() as folder:
        figures = LiveFigures(drive.name, "mapper")
        figures.scans = reader.topics[reader.scan_topic].message_count
        figures.odometry = reader.topics[reader.odom_topic].message_count if reader.odom_topic else 0
        offline = build_map(reader, config, Report("offline"), quiet=True).trajectory
        out = Path(folder) / "map"
        summary, _ = _run(["live", "map", "--out", str(out)], drive, reader.odom_topic, domain, speed)
        _take_summary(figures, summary)
        live = load_tum(out / "trajectory.tum")
        figures.posed = len(live)
        figures.peak_memory_mb = loads((out / "report.json").read_text())["peak_memory_mb"]
        figures.longest_backlog_s = summary["longest_backlog"]
        difference = compare(live, offline).summary()["absolute_position_m"]
        figures.from_offline_map_m = difference["mean"]
        if drive.truth is not None:
            figures.error_live_m = compare(live, drive.truth).summary()["absolute_position_m"]["mean"]
            figures.error_offline_m = compare(offline, drive.truth).summary()["absolute_position_m"]["mean"]
    return figures


def _find_start(reader: BagReader, drive: PlayedDrive, config: LocalizationConfig) -> Pose:
    """(3,) known, or found by a search of the whole map."""
    if drive.truth is not None:
        start: Pose = drive.truth.map_from_base[0]
        return start
    localizer = Localizer(load_map(drive.map), config, np.random.default_rng(0))
    for replayed in replay(reader, localizer):
        return replayed.answer.map_from_base
    raise UserError(f"{drive.bag} holds no usable scan.")


def _localize_offline(
    reader: BagReader, drive: PlayedDrive, config: LocalizationConfig, start: Pose
) -> Trajectory:
    localizer = Localizer(load_map(drive.map), config, np.random.default_rng(0))
    localizer.set_pose(start)
    estimates = [replayed.answer for replayed in replay(reader, localizer)]
    stamps = np.array([estimate.stamp for estimate in estimates], dtype=np.int64)
    return Trajectory(stamps, np.array([estimate.map_from_base for estimate in estimates]))


def _run(
    arguments: list[str], drive: PlayedDrive, odom_topic: str | None, domain: int, speed: float
) -> tuple[dict[str, Any], NodeListener]:
    """Play the bag to a node; its summary, with its memory of every second, and what was heard of it."""
    environment = private_environment(domain)
    os.environ.update({name: environment[name] for name in environment if name.startswith("ROS_")})
    with tempfile.TemporaryDirectory() as folder:
        summary, log = Path(folder) / "summary.json", Path(folder) / "log"
        remapped = ["--ros-args", "-r", f"odom:={odom_topic}"] if odom_topic else []
        command = [*arguments, "--json", str(summary), *remapped]
        with listening() as heard, racecar_process(command, environment, log) as node:
            _wait_for(lambda: heard.is_node_there() or node.poll() is not None)
            if node.poll() is not None:
                raise UserError(f"The node does not start: {log.read_text().strip()}")
            memory: list[float] = []
            play = ["play", str(drive.bag), "--quiet", "--speed", str(speed)]
            play += ["--listeners", "2", "--wait", "30"]  # the node, and this process
            began, stolen = time.monotonic(), _stolen_seconds()
            with racecar_process(play, environment, log) as player:
                while player.poll() is None:
                    memory.append(resident_memory_mb(node.pid))
                    time.sleep(_MEMORY_EVERY)
            share = (_stolen_seconds() - stolen) / (time.monotonic() - began)
            time.sleep(1.0)
        return {**loads(summary.read_text()), "memory_mb": memory, "stolen_share": share}, heard


def _stolen_seconds() -> float:
    """Processor time that the host gave to others since this machine started; nan where it is not known."""
    try:
        stolen = Path("/proc/stat").read_text().split(maxsplit=9)[8]
    except (OSError, IndexError):
        return float("nan")
    return int(stolen) / os.sysconf("SC_CLK_TCK")


def _wait_for(condition: Callable[[], bool]) -> None:
    until = time.monotonic() + _READY_SECONDS
    while not condition():
        if time.monotonic() > until:
            raise UserError(f"The node was not ready after {_READY_SECONDS:.0f} s.")
        time.sleep(0.1)


def _take_summary(figures: LiveFigures, summary: dict[str, Any]) -> None:
    figures.received = summary["counts"].get("scans", 0)
    figures.latency_ms = summary["latency_ms"]
    figures.latency_ms_by_tenth = summary["latency_ms_by_tenth"]
    figures.cpu_share = summary["cpu_share"]
    figures.stolen_share = summary["stolen_share"]
    figures.faults = summary["faults"]
    figures.memory_mb_by_tenth = [
        float(np.median(tenth)) for tenth in np.array_split(summary["memory_mb"], 10) if len(tenth)
    ]
    figures.peak_memory_mb = summary["peak_memory_mb"]


def _mean_error(estimated: Trajectory, truth: Trajectory) -> float:
    errors = compare(estimated, truth, reference_from_map=IDENTITY)
    return float(errors.positions.mean())


def _share_on_walls(reader: BagReader, trajectory: Trajectory, drive: PlayedDrive) -> float:
    """How much of the scans lies on walls, seen from the poses that were estimated for them."""
    walls = WallFit(load_map(drive.map))
    poses = dict(zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True))
    shares = [
        walls.share(message, poses[message.stamp])
        for message in reader
        if isinstance(message, Scan) and message.stamp in poses
    ]
    return float(np.nanmean(shares)) if np.isfinite(shares).any() else 0.0
