"""How fast, how well and at what cost the nodes run while another process plays a bag."""

import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from json import loads
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry as OdometryMessage
from sensor_msgs.msg import LaserScan

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.warm_up import warm_up
from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.map_files import load_map
from racecar.maps.sensing.scan import Scan
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import nanoseconds
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.evaluation.evaluation import compare
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report, resident_memory_mb
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.node import sensor_qos
from racecar.pipelines.live.ros.processes import private_environment, racecar_process
from racecar.pipelines.live.ros.run import ros_node, served
from racecar.pipelines.runs.localization_run import estimates
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig

_ON_WALL = 0.10
"""Metres from a wall within which a scan's end point counts as on it."""
_DOMAINS = range(30, 100)
"""Of ROS, which others on the machine hardly use."""
_READY_SECONDS = 120.0
_MEMORY_EVERY = 1.0
"""Seconds."""


@dataclass(frozen=True)
class LiveDrive:
    """A bag to be played, and what is known of it."""

    name: str
    bag: Path
    map: Path
    truth: Trajectory | None = None


@dataclass
class LiveFigures:
    """What one drive came to; None where it does not apply."""

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


def simulated_drive(folder: Path, seconds: float, seed: int) -> LiveDrive:
    """A drive through the shipped building, whose truth is known."""
    config = SimulationConfig(noise="slight", seed=seed, duration=seconds)
    simulation = Simulation(load_map(Path("building")), config)
    bag = folder / "simulated"
    write_bag(simulation, bag, lambda share: None)
    return LiveDrive("simulated", bag, Path("building"), simulation.ground_truth)


def recorded_drive(recordings: Path) -> LiveDrive | None:
    """The race car in the basement, where there are recordings."""
    bag = recordings / "racecar" / "session_A"
    if not bag.exists():
        return None
    return LiveDrive("session_A", bag, recordings / "racecar" / "maps" / "stata_basement.yaml")


def measure_localizer(drive: LiveDrive, config: LocalizationConfig, domain: int, speed: float) -> LiveFigures:
    """Replay a drive offline, then play it to the node, so many times as fast, from the same start."""
    warm_up(LocalizationConfig())
    with BagReader(drive.bag) as reader:
        figures = LiveFigures(drive.name, "localizer")
        figures.scans = reader.topics[reader.scan_topic].message_count
        figures.odometry = reader.topics[reader.odom_topic].message_count if reader.odom_topic else 0
        start = _find_start(reader, drive, config)
        offline = _replay(reader, drive, config, start)
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


def measure_mapper(drive: LiveDrive, config: MappingConfig, domain: int, speed: float) -> LiveFigures:
    """Map a drive offline, then play it to the node, so many times as fast."""
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


def _find_start(reader: BagReader, drive: LiveDrive, config: LocalizationConfig) -> Pose:
    """(3,) known, or found by a search of the whole map."""
    if drive.truth is not None:
        start: Pose = drive.truth.map_from_base[0]
        return start
    localizer = Localizer(load_map(drive.map), config, np.random.default_rng(0))
    for _, estimate in estimates(reader, localizer):
        return estimate.map_from_base
    raise UserError(f"{drive.bag} holds no usable scan.")


def _replay(reader: BagReader, drive: LiveDrive, config: LocalizationConfig, start: Pose) -> Trajectory:
    localizer = Localizer(load_map(drive.map), config, np.random.default_rng(0))
    localizer.set_pose(start)
    stamps, poses = [], []
    for _, estimate in estimates(reader, localizer):
        stamps.append(estimate.stamp)
        poses.append(estimate.map_from_base)
    return Trajectory(np.array(stamps, dtype=np.int64), np.array(poses))


def _run(
    arguments: list[str], drive: LiveDrive, odom_topic: str | None, domain: int, speed: float
) -> "tuple[dict[str, Any], _Heard]":
    """Play the bag to a node; its summary, with its memory of every second, and what was heard of it."""
    environment = private_environment(domain)
    os.environ.update({name: environment[name] for name in environment if name.startswith("ROS_")})
    with tempfile.TemporaryDirectory() as folder:
        summary, log = Path(folder) / "summary.json", Path(folder) / "log"
        remapped = ["--ros-args", "-r", f"odom:={odom_topic}"] if odom_topic else []
        command = [*arguments, "--json", str(summary), *remapped]
        with _listening() as heard, racecar_process(command, environment, log) as node:
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
    """Processor time that the host gave to others since this machine started; nan where that is not told."""
    try:
        stolen = Path("/proc/stat").read_text().split(maxsplit=9)[8]
    except (OSError, IndexError):
        return float("nan")
    return int(stolen) / os.sysconf("SC_CLK_TCK")


class _Heard:
    """What a node told."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self._poses: dict[int, Pose] = {}
        self._scans_at: dict[int, float] = {}
        self._poses_at: dict[int, float] = {}
        self.pose_messages = 0
        node.create_subscription(LaserScan, "/scan", self._on_scan, sensor_qos(1000))
        node.create_subscription(PoseWithCovarianceStamped, "/amcl_pose", self._on_pose, 1000)
        node.create_subscription(OdometryMessage, "/pf/pose/odom", self._on_odometry, 1000)

    def is_node_there(self) -> bool:
        """Whether another node listens to scans."""
        return int(self._node.count_subscribers("/scan")) > 1

    def latency_ms(self) -> dict[str, float]:
        """Median and 99th percentile from a scan's arrival here to that of its pose."""
        both = [
            (self._scans_at[stamp], at) for stamp, at in self._poses_at.items() if stamp in self._scans_at
        ]
        if not both:
            return {}
        median, high = np.quantile([1e3 * (pose - scan) for scan, pose in both], [0.5, 0.99])
        return {"median": float(median), "percentile_99": float(high)}

    def trajectory(self) -> Trajectory:
        """The poses by the stamps of their scans."""
        stamps = sorted(self._poses)
        return Trajectory(
            np.array(stamps, dtype=np.int64), np.array([self._poses[s] for s in stamps]).reshape(-1, 3)
        )

    def _on_scan(self, message: Any) -> None:
        self._scans_at[nanoseconds(message.header.stamp)] = time.monotonic()

    def _on_pose(self, message: Any) -> None:
        self._poses_at[nanoseconds(message.header.stamp)] = time.monotonic()
        pose = planar_pose(message)
        if pose is not None:
            self._poses[nanoseconds(message.header.stamp)] = pose

    def _on_odometry(self, message: Any) -> None:
        self.pose_messages += 1


@contextmanager
def _listening() -> Iterator[_Heard]:
    with ros_node("racecar_benchmark", []) as node:
        heard = _Heard(node)
        with served(node):
            yield heard


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


def _share_on_walls(reader: BagReader, trajectory: Trajectory, drive: LiveDrive) -> float:
    """How much of the scans lies on walls, seen from the poses that were told for them."""
    grid = load_map(drive.map)
    walls = distance_to_occupied(grid)
    poses = dict(zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True))
    shares = []
    for message in reader:
        if isinstance(message, Scan) and message.stamp in poses:
            points = transform_points(poses[message.stamp], message.points_in_base())
            if len(points):
                shares.append(float(np.mean(sample_field(walls, grid, points) <= _ON_WALL)))
    return float(np.mean(shares)) if shares else 0.0
