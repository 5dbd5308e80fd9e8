"""A bag played by one process, localized and mapped by others, over real DDS."""

import json
import os
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.ros.processes import racecar_process
from racecar.pipelines.runs.evaluation.evaluation import compare
from tests.end_to_end.commands import Racecar, simulate

pytestmark = pytest.mark.usefixtures("ros")


def await_listeners(count: int, processes: list[Any], log: Path) -> None:
    """Until so many nodes hear the scans, or one has ended."""
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_readiness", []) as watcher:
        until = time.monotonic() + 180.0
        while watcher.count_subscribers("/scan") < count and all(each.poll() is None for each in processes):
            assert time.monotonic() < until, log.read_text()
            time.sleep(0.05)


@contextmanager
def running(
    commands: Sequence[Sequence[str]],
    environment: dict[str, str],
    folder: Path,
    seconds_to_end: float = 120.0,
) -> Iterator[list[Any]]:
    """The processes of some nodes that wait for scans, and end well in the end.

    All log to ``log`` in a folder, and leave their figures in ``0.json`` and so on.
    """
    log = folder / "log"
    with ExitStack() as nodes:
        processes = []
        for number, command in enumerate(commands):
            cut = command.index("--ros-args") if "--ros-args" in command else len(command)
            words = [*command[:cut], "--json", str(folder / f"{number}.json"), *command[cut:]]
            processes.append(nodes.enter_context(racecar_process(words, environment, log, seconds_to_end)))
        await_listeners(len(commands), processes, log)
        yield processes
    assert [each.returncode for each in processes] == [0] * len(commands), log.read_text()


def play(bag: Path, listeners: int, environment: dict[str, str], log: Path, *flags: str) -> Any:
    """The process that plays a bag while the block lasts."""
    to = ("--listeners", str(listeners), "--wait", "60")
    return racecar_process(["play", str(bag), "--quiet", *to, *flags], environment, log)


def figures_of(folder: Path, number: int = 0) -> dict[str, Any]:
    return dict(json.loads((folder / f"{number}.json").read_text()))


def scans_in(bag: Path) -> int:
    with BagReader(bag) as reader:
        return reader.topics[reader.scan_topic].message_count


def start_of(drive: Path) -> list[str]:
    truth = load_tum(drive / "drive.ground_truth.tum")
    return ["--initial-pose", *(f"{value:.6f}" for value in truth.map_from_base[0])]


def localizer(drive: Path, *flags: str) -> list[str]:
    return ["live", "localize", "--map", "building", "--no-memory", *start_of(drive), *flags]


def test_a_played_bag_is_localized_and_mapped_and_watched_at_once(
    drive: Path, mapped: Path, ros: dict[str, str], tmp_path: Path
) -> None:
    bag, log, out = drive / "drive.bag", tmp_path / "log", tmp_path / "live"
    before, scans = listening_everywhere(), scans_in(drive / "drive.bag")
    with running([localizer(drive, "--view"), ["live", "map", "--out", str(out)]], ros, tmp_path):
        assert_page_is_served_to_this_machine_only(log.read_text(), before)
        with play(bag, 2, ros, log) as player:
            assert player.wait(300) == 0, log.read_text()
        time.sleep(0.5)
    figures = figures_of(tmp_path)
    assert figures["counts"]["scans"] == scans
    assert figures["dropped"] == {}
    assert figures["counts"]["poses"] == pytest.approx(figures["counts"]["odometry"], abs=25)
    assert set(figures["faults"]) <= {"no_scans", "no_odometry"}  # before the bag began, and after its end
    assert figures_of(tmp_path, 1)["counts"]["poses"] == scans
    errors = compare(load_tum(out / "trajectory.tum"), load_tum(mapped / "trajectory.tum"))
    assert errors.matched == errors.total
    assert errors.positions.mean() < 0.05


def test_a_ros_from_pypi_is_found_without_any_setup(drive: Path, tmp_path: Path) -> None:
    """The command starts itself anew where neither the wheels nor the shell have set the paths."""
    bare = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    bare["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"  # as in a process that was started by another environment's
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", "play", str(tmp_path / "none.bag")]
    done = subprocess.run(command, env=bare, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 2
    assert "does not exist" in done.stderr


def assert_page_is_served_to_this_machine_only(said: str, before: set[int]) -> None:
    """``before``: ports that anybody listened on from everywhere then."""
    port = int(said.split("Look at http://127.0.0.1:")[1].split("/")[0])
    with socket.create_connection(("127.0.0.1", port), timeout=5.0):
        pass
    assert port in {port for address, port in _listening() if address == "127.0.0.1"}
    assert port not in listening_everywhere()
    assert listening_everywhere() <= before


def listening_everywhere() -> set[int]:
    return {port for address, port in _listening() if not address.startswith("127.")}


def _listening() -> list[tuple[str, int]]:
    found = []
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        local, state = line.split()[1], line.split()[3]
        if state == "0A":
            address, port = local.split(":")
            found.append((socket.inet_ntoa(struct.pack("<I", int(address, 16))), int(port, 16)))
    return found


@pytest.mark.slow
def test_no_scan_of_the_race_car_is_lost(
    recordings: Path, racecar_command: Racecar, ros: dict[str, str], tmp_path: Path
) -> None:
    """At real speed, with its pauses, after which the whole map is searched."""
    bag, map_ = recordings / "racecar" / "session_A", recordings / "racecar" / "maps" / "stata_basement.yaml"
    racecar_command("localize", bag, "--map", map_, "--out", tmp_path / "offline", "--global", "--quiet")
    found = load_tum(tmp_path / "offline" / "trajectory.tum")
    start = ["--initial-pose", *(f"{value:.6f}" for value in found.map_from_base[40])]
    remapped = ["--ros-args", "-r", "odom:=/vesc/odom"]
    node = ["live", "localize", "--map", str(map_), "--no-memory", *start, *remapped]
    with running([node], ros, tmp_path), play(bag, 1, ros, tmp_path / "log") as player:
        assert player.wait(300) == 0
    assert figures_of(tmp_path)["counts"]["scans"] == scans_in(bag)
    assert figures_of(tmp_path)["dropped"] == {}


@pytest.mark.slow
def test_memory_does_not_grow_with_the_drive(
    racecar_command: Racecar, ros: dict[str, str], tmp_path: Path
) -> None:
    """Ten minutes of driving, played five times as fast."""
    bag, log = tmp_path / "drive", tmp_path / "log"
    simulate(racecar_command, bag, 600)
    sizes = []
    with (
        running([localizer(tmp_path)], ros, tmp_path) as (node,),
        play(bag, 1, ros, log, "--speed", "5") as player,
    ):
        while player.poll() is None:
            time.sleep(10.0)
            sizes.append(resident_memory_mb(node.pid))
    assert figures_of(tmp_path)["dropped"] == {}, log.read_text()
    assert sizes[-2] < 1.05 * sizes[1], sizes


SOAK_SPEED = 3.0


@pytest.mark.slow
@pytest.mark.parametrize("node", ["localize", "map"])
def test_a_node_soaks_on_busy_cores(
    node: str, racecar_command: Racecar, ros: dict[str, str], tmp_path: Path
) -> None:
    """Twenty minutes, or as many as the variable SOAK_MINUTES says."""
    minutes = float(os.environ.get("SOAK_MINUTES", "20"))
    bag, log = tmp_path / "drive", tmp_path / "log"
    simulate(racecar_command, bag, 60 * minutes * SOAK_SPEED)
    options = {"localize": localizer(tmp_path), "map": ["live", "map", "--out", str(tmp_path / "out")]}
    sizes: list[float] = []
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    try:
        with (
            running([options[node]], ros, tmp_path, 900.0) as (process,),
            play(bag, 1, ros, log, "--speed", str(SOAK_SPEED)) as player,
        ):
            while player.poll() is None:
                time.sleep(60 * minutes / 40)
                sizes.append(resident_memory_mb(process.pid))
    finally:
        for each in busy:
            each.kill()
            each.wait()
    figures = figures_of(tmp_path)
    print(node, figures, sizes)
    assert figures["dropped"] == {}, log.read_text()
    assert not [name for name in figures["faults"] if name.startswith("internal")], log.read_text()
    scans = scans_in(bag)
    assert figures["counts"]["scans"] == scans
    if node == "map":
        assert figures["counts"]["poses"] == scans
        assert len(load_tum(tmp_path / "out" / "trajectory.tum").stamps) == scans
    half = len(sizes) // 2
    assert max(sizes[half:]) < max(sizes[:half]) + 20.0 * minutes / 10.0, sizes
