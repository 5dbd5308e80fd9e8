"""The speed, accuracy and cost of the nodes while another process plays a bag."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from json import loads
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, TypeAlias

import numpy as np
import typer

from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import recordings_folder
from benchmarks.harness.table import Column, cells, transposed
from benchmarks.live.played_drives import PlayedDrive, recorded_drive, simulated_drive
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.warm_up import warm_up
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.ros.start import start_ros
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.pipelines.runs.evaluation.wall_fit import WallFit
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.sensors.scan import Scan

_DOMAINS = range(30, 100)
"""ROS domains that others on the machine hardly use."""


@dataclass(frozen=True)
class LiveFigures:
    """The figures of one node on one drive; None where one does not apply."""

    scans: Annotated[int, Column("scans in the bag")]
    received: Annotated[int, Column("scans received")]
    posed: Annotated[int, Column("scans with a pose")]
    odometry: Annotated[int, Column("odometry in the bag")]
    pose_messages: Annotated[int | None, Column("poses at odometry's rate")]
    latency_ms: Annotated[float | None, Column("latency, median (ms)", ".2f")]
    latency_99_ms: Annotated[float | None, Column("latency, 99 % (ms)", ".2f")]
    latency_ms_by_tenth: Annotated[list[float], Column("medians by tenth of the drive (ms)", ".1f")]
    seen_latency_ms: Annotated[float | None, Column("seen from outside, median (ms)", ".2f")]
    """From the arrival of a scan in another process to the arrival of its pose there."""
    seen_latency_99_ms: Annotated[float | None, Column("seen from outside, 99 % (ms)", ".2f")]
    memory_mb_by_tenth: Annotated[list[float], Column("memory by tenth of the drive (MB)", ".0f")]
    """Medians of the memory of the node's process, in the order of the drive."""
    peak_memory_mb: Annotated[float, Column("memory at most (MB)", ".0f")]
    """Including while it saved a map."""
    cpu_share: Annotated[float, Column("share of a core", ".1%")]
    stolen_share: Annotated[float, Column("of a core, taken by other machines", ".1%")]
    """Given to other virtual machines on the same host during the drive, which delays scans."""
    error_live_m: Annotated[float | None, Column("error, live (m)", ".4f")]
    error_offline_m: Annotated[float | None, Column("error, offline (m)", ".4f")]
    on_walls_live: Annotated[float | None, Column("end points on walls, live", ".3f")]
    on_walls_offline: Annotated[float | None, Column("end points on walls, offline", ".3f")]
    longest_backlog_s: Annotated[float | None, Column("longest backlog (s)", ".3f")]
    from_offline_map_m: Annotated[float | None, Column("from the offline map's path (m)", ".4f")]
    faults: dict[str, int]


@dataclass(frozen=True)
class Playback:
    """How bags are played to a node."""

    settings: Config
    speed: float
    """1 is real time."""
    domain: int
    """ROS domain."""


PlayedNode: TypeAlias = Callable[[PlayedDrive, BagReader, Playback], LiveFigures]


def live(
    bench: Bench,
    seconds: Annotated[
        float, typer.Option("--seconds", min=5.0, metavar="SECONDS", help="Length of the simulated drive.")
    ] = 60.0,
    speed: Annotated[
        float,
        typer.Option("--speed", min=0.1, max=20.0, metavar="FACTOR", help="Playback speed; 1 is real time."),
    ] = 1.0,
    recorded: Annotated[
        bool,
        typer.Option("--recorded/--no-recorded", help="Also play session_A, where there are recordings."),
    ] = True,
    localizer: Annotated[
        bool, typer.Option("--localizer/--no-localizer", help="Measure the localizer's node.")
    ] = True,
    mapper: Annotated[bool, typer.Option("--mapper/--no-mapper", help="Measure the mapper's node.")] = True,
) -> None:
    """Play drives to the ROS 2 nodes, and compare latency, CPU, memory and accuracy with offline runs.

    Example: python -m benchmarks live --seconds 60
    """
    start_ros()
    nodes: dict[str, PlayedNode] = {"localizer": play_to_localizer} if localizer else {}
    nodes |= {"mapper": play_to_mapper} if mapper else {}
    playback = Playback(bench.settings, speed, _DOMAINS[os.getpid() % len(_DOMAINS)])

    def play(drive: PlayedDrive, node: PlayedNode) -> LiveFigures:
        with BagReader(drive.bag) as reader:
            return node(drive, reader, playback)

    with TemporaryDirectory() as folder:
        drives = [simulated_drive(Path(folder), seconds, bench.seed)]
        session = recorded_drive(recordings_folder()) if recorded else None
        named = [(drive.name, drive) for drive in [*drives, *([session] if session else [])]]
        rows = bench.cross("live", named, nodes, play)
    by_node = {f"{node}\n{drive}": cells(rows[drive][node]) for node in nodes for drive in rows}
    bench.table(f"Live, at {speed:g} times real speed", transposed(by_node))


def play_to_localizer(drive: PlayedDrive, reader: BagReader, playback: Playback) -> LiveFigures:
    """Replay a drive offline, then play it to the node, from the same start."""
    from benchmarks.live.played_node import play_to_node

    warm_up(LocalizationConfig())
    config = playback.settings.localization
    start = _find_start(reader, drive, config)
    offline = _localize_offline(reader, drive, config, start)
    pose = [f"{value:.6f}" for value in start]
    arguments = ["live", "localize", "--map", str(drive.map), "--no-memory", "--initial-pose", *pose]
    summary, heard = play_to_node(arguments, drive, reader.odom_topic, playback.domain, playback.speed)
    trajectory, seen = heard.trajectory(), heard.latency_ms()
    walls = WallFit(load_map(drive.map))
    return LiveFigures(
        **_of_both(reader, summary),
        posed=len(trajectory),
        pose_messages=heard.pose_messages,
        seen_latency_ms=seen.get("median"),
        seen_latency_99_ms=seen.get("percentile_99"),
        peak_memory_mb=summary["peak_memory_mb"],
        error_live_m=_mean_error(trajectory, drive.truth),
        error_offline_m=_mean_error(offline, drive.truth),
        on_walls_live=_share_on_walls(walls, reader, trajectory),
        on_walls_offline=_share_on_walls(walls, reader, offline),
        longest_backlog_s=None,
        from_offline_map_m=None,
    )


def play_to_mapper(drive: PlayedDrive, reader: BagReader, playback: Playback) -> LiveFigures:
    """Map a drive offline, then play it to the node."""
    from benchmarks.live.played_node import play_to_node

    offline = build_map(reader, playback.settings, RunContext(), learns_sensors=False).trajectory
    with TemporaryDirectory() as folder:
        out = Path(folder) / "map"
        arguments = ["live", "map", "--out", str(out)]
        summary, _ = play_to_node(arguments, drive, reader.odom_topic, playback.domain, playback.speed)
        trajectory = load_tum(out / "trajectory.tum")
        peak_memory_mb = loads((out / "report.json").read_text())["peak_memory_mb"]
    return LiveFigures(
        **_of_both(reader, summary),
        posed=len(trajectory),
        pose_messages=None,
        seen_latency_ms=None,
        seen_latency_99_ms=None,
        peak_memory_mb=peak_memory_mb,
        error_live_m=_path_error(trajectory, drive.truth),
        error_offline_m=_path_error(offline, drive.truth),
        on_walls_live=None,
        on_walls_offline=None,
        longest_backlog_s=summary["longest_backlog"],
        from_offline_map_m=_path_error(trajectory, offline),
    )


def _of_both(reader: BagReader, summary: dict[str, Any]) -> dict[str, Any]:
    """The figures common to both nodes."""
    tenths = [tenth for tenth in np.array_split(summary["memory_mb"], 10) if len(tenth)]
    return {
        "scans": reader.topics[reader.scan_topic].message_count,
        "odometry": reader.topics[reader.odom_topic].message_count if reader.odom_topic else 0,
        "received": summary["counts"].get("scans", 0),
        "latency_ms": summary["latency_ms"].get("median"),
        "latency_99_ms": summary["latency_ms"].get("percentile_99"),
        "latency_ms_by_tenth": summary["latency_ms_by_tenth"],
        "memory_mb_by_tenth": [float(np.median(tenth)) for tenth in tenths],
        "cpu_share": summary["cpu_share"],
        "stolen_share": summary["stolen_share"],
        "faults": summary["faults"],
    }


def _find_start(reader: BagReader, drive: PlayedDrive, config: LocalizationConfig) -> Pose:
    """(3,) as known, or found by a search of the whole map."""
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


def _mean_error(estimated: Trajectory, truth: Trajectory | None) -> float | None:
    """Metres, in the map frame; None if the truth is unknown."""
    if truth is None:
        return None
    return float(compare(estimated, truth, reference_from_map=IDENTITY).positions.mean())


def _path_error(estimated: Trajectory, truth: Trajectory | None) -> float | None:
    """Metres, after aligning the paths; None if the truth is unknown."""
    return None if truth is None else compare(estimated, truth).summary()["absolute_position_m"]["mean"]


def _share_on_walls(walls: WallFit, reader: BagReader, trajectory: Trajectory) -> float:
    """The share of the scans' points that lie on walls, from the estimated poses."""
    poses = dict(zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True))
    shares = [
        walls.share(message, poses[message.stamp])
        for message in reader
        if isinstance(message, Scan) and message.stamp in poses
    ]
    return float(np.nanmean(shares)) if np.isfinite(shares).any() else 0.0
