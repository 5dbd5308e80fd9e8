"""A bag played by one process, localized and mapped by others, over real DDS."""

import json
import os
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.ros.processes import racecar_process
from racecar.pipelines.runs.evaluation.evaluation import compare
from tests.end_to_end.commands import Racecar

pytestmark = pytest.mark.usefixtures("ros")


def wait_until(condition: Callable[[], bool], within: float, log: Path) -> None:
    until = time.monotonic() + within
    while not condition():
        assert time.monotonic() < until, log.read_text()
        time.sleep(0.05)


def play_to(node: list[str], bag: Path, environment: dict[str, str], folder: Path, *flags: str) -> dict:
    """Play a bag to a node; the node's figures."""
    from racecar.pipelines.live.ros.run import ros_node

    summary, log = folder / "summary.json", folder / "log"
    cut = node.index("--ros-args") if "--ros-args" in node else len(node)
    command = [*node[:cut], "--json", str(summary), *node[cut:]]
    with racecar_process(command, environment, log) as process:
        with ros_node("test_readiness", []) as watcher:
            wait_until(
                lambda: bool(watcher.count_subscribers("/scan")) or process.poll() is not None, 90.0, log
            )
        with racecar_process(
            ["play", str(bag), "--quiet", "--listeners", "1", "--wait", "20", *flags], environment, log
        ) as player:
            assert player.wait(300) == 0, log.read_text()
        time.sleep(0.5)
    assert process.returncode == 0, log.read_text()
    return json.loads(summary.read_text())


def scans_in(bag: Path) -> int:
    with BagReader(bag) as reader:
        return reader.topics[reader.scan_topic].message_count


def start_of(drive: Path) -> list[str]:
    truth = load_tum(drive / "drive.ground_truth.tum")
    return ["--initial-pose", *(f"{value:.6f}" for value in truth.map_from_base[0])]


def test_every_scan_of_a_played_bag_is_localized(drive: Path, ros: dict[str, str], tmp_path: Path) -> None:
    node = ["live", "localize", "--map", "building", "--no-memory", *start_of(drive)]
    figures = play_to(node, drive / "drive.bag", ros, tmp_path)
    assert figures["counts"]["scans"] == scans_in(drive / "drive.bag")
    assert figures["dropped"] == {}
    assert figures["counts"]["poses"] == pytest.approx(figures["counts"]["odometry"], abs=25)
    assert set(figures["faults"]) <= {"no_scans", "no_odometry"}  # before the bag began, and after its end


def test_a_played_bag_is_mapped_as_it_is_offline(
    drive: Path, mapped: Path, ros: dict[str, str], tmp_path: Path
) -> None:
    out = tmp_path / "live"
    figures = play_to(["live", "map", "--out", str(out)], drive / "drive.bag", ros, tmp_path)
    assert figures["counts"]["poses"] == scans_in(drive / "drive.bag")
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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["live", "localize", "--map", "nowhere"], "There is no map at"),
        (["live", "localize", "--map", "building", "--global", "--initial-pose", "0", "0", "0"], "exclude"),
        (["live", "localize", "--map", "building", "--initial-pose", "999", "0", "0"], "free space"),
        (["live", "localize", "--map", "building", "--ros-args", "-p", "tf:=maybe"], "parameter tf"),
        (["live", "localize", "--map", "building", "--ros-args", "-p", "particles:=none"], "particles"),
        (["live", "localize", "--map", "building", "--ros-args", "--nonsense"], "ROS does not start"),
        (["live", "localize", "--mop", "building"], "No such option"),
        (["live", "map", "--out", "/proc/nowhere"], "Cannot write"),
        (["live", "map", "--out", "x", "--ros-args", "-p", "laser_pose:=[1.0, 2.0]"], "laser_pose"),
    ],
)
def test_a_mistake_is_one_sentence(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


def test_the_page_is_served_to_this_machine_only(ros: dict[str, str], tmp_path: Path) -> None:
    log = tmp_path / "log"
    node = ["live", "localize", "--map", "building", "--global", "--no-memory", "--view"]
    before = listening_everywhere()
    with racecar_process(node, ros, log):
        wait_until(lambda: "Look at http://127.0.0.1:" in log.read_text(), 60.0, log)
        port = int(log.read_text().split("http://127.0.0.1:")[1].split("/")[0])
        with socket.create_connection(("127.0.0.1", port), timeout=5.0):
            pass
        assert port in listening_on_loopback()
        assert port not in listening_everywhere()
        assert listening_everywhere() <= before


def listening_on_loopback() -> set[int]:
    return {port for address, port in _listening() if address == "127.0.0.1"}


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
    offline = racecar_command(
        "localize", bag, "--map", map_, "--out", tmp_path / "offline", "--global", "--quiet"
    )
    assert offline.returncode == 0, offline.stderr
    found = load_tum(tmp_path / "offline" / "trajectory.tum")
    start = ["--initial-pose", *(f"{value:.6f}" for value in found.map_from_base[40])]
    node = ["live", "localize", "--map", str(map_), "--no-memory", *start]
    figures = play_to([*node, "--ros-args", "-r", "odom:=/vesc/odom"], bag, ros, tmp_path)
    assert figures["counts"]["scans"] == scans_in(bag)
    assert figures["dropped"] == {}


@pytest.mark.slow
def test_memory_does_not_grow_with_the_drive(
    racecar_command: Racecar, ros: dict[str, str], tmp_path: Path
) -> None:
    """Ten minutes of driving, played five times as fast."""
    from racecar.pipelines.live.ros.run import ros_node

    bag, log, summary = tmp_path / "drive", tmp_path / "log", tmp_path / "summary.json"
    simulated = racecar_command(
        *("simulate", "--map", "building", "--out", bag, "--noise", "slight", "--duration", "600", "--quiet")
    )
    assert simulated.returncode == 0, simulated.stderr
    node = ["live", "localize", "--map", "building", "--no-memory", *start_of(tmp_path)]
    sizes = []
    with racecar_process([*node, "--json", str(summary)], ros, log) as process:
        with ros_node("test_readiness", []) as watcher:
            wait_until(lambda: bool(watcher.count_subscribers("/scan")), 90.0, log)
        play = ["play", str(bag), "--quiet", "--listeners", "1", "--wait", "20", "--speed", "5"]
        with racecar_process(play, ros, log) as player:
            while player.poll() is None:
                time.sleep(10.0)
                sizes.append(resident_memory_mb(process.pid))
    assert json.loads(summary.read_text())["dropped"] == {}, log.read_text()
    assert sizes[-2] < 1.05 * sizes[1], sizes


SOAK_SPEED = 3.0


@pytest.mark.slow
@pytest.mark.parametrize("node", ["localize", "map"])
def test_a_node_soaks_on_busy_cores(
    node: str, racecar_command: Racecar, ros: dict[str, str], tmp_path: Path
) -> None:
    """Twenty minutes, or as many as the variable SOAK_MINUTES says."""
    from racecar.pipelines.live.ros.run import ros_node

    minutes = float(os.environ.get("SOAK_MINUTES", "20"))
    bag, log, summary = tmp_path / "drive", tmp_path / "log", tmp_path / "summary.json"
    drive = ["--map", "building", "--noise", "slight", "--duration", str(60 * minutes * SOAK_SPEED)]
    simulated = racecar_command("simulate", *drive, "--out", bag, "--quiet")
    assert simulated.returncode == 0, simulated.stderr
    options = {
        "localize": ["--map", "building", "--no-memory", *start_of(tmp_path)],
        "map": ["--out", str(tmp_path / "out")],
    }
    sizes: list[float] = []
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    try:
        with racecar_process(
            ["live", node, *options[node], "--json", str(summary)], ros, log, 900
        ) as process:
            with ros_node("test_readiness", []) as watcher:
                wait_until(lambda: bool(watcher.count_subscribers("/scan")), 180.0, log)
            play = ["play", str(bag), "--quiet", "--listeners", "1", "--wait", "60"]
            with racecar_process([*play, "--speed", str(SOAK_SPEED)], ros, log) as player:
                while player.poll() is None:
                    time.sleep(60 * minutes / 40)
                    sizes.append(resident_memory_mb(process.pid))
        assert process.returncode == 0, log.read_text()
    finally:
        for each in busy:
            each.kill()
            each.wait()
    figures = json.loads(summary.read_text())
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
