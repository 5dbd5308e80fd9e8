"""However a live mapper is ended, and killed soon after, there is a map of what it has seen."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from racecar.maps.map_files import load_map
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.saving.drive_log import DriveLog
from racecar.sensors.scan import Scan
from tests.pipelines.live.live_car import LiveCar, recorded

pytestmark = pytest.mark.usefixtures("ros")

KILLED_AFTER = 5.0
"""Seconds, as of launch files."""
_HANGS = 200.0
"""Seconds after which whatever is waited for on a busy computer does not come any more."""


@dataclass(frozen=True)
class Moment:
    """When the signal comes: as the node calls a function, where it is held up."""

    where: str
    nth: int = 1
    seconds: float = 60.0
    each: bool = False
    is_after_end: bool = False
    """Whether the node has been ended by Ctrl-C before."""
    goes_on: bool = False
    """Whether it goes on with the drive of a killed one."""
    has_scans: bool = True


NODE = "racecar.pipelines.live.mapper_node:MapperNode"
MAPPER = "racecar.mapping.mapper:Mapper"
FILES = "racecar.pipelines.runs.map_outputs"
MOMENTS = {
    "starting": Moment("racecar.mapping.warm_up:warm_up", has_scans=False),
    "waiting for scans": Moment(f"{NODE}.watch", 4, 0.1, has_scans=False),
    "at the second scan": Moment(f"{MAPPER}.add_scan", 2, 0.5),
    "driving": Moment(f"{MAPPER}.add_scan", 120, 0.0),
    "while a loop is closed": Moment(f"{MAPPER}._grow_submaps", 30),
    "with a long backlog": Moment(f"{MAPPER}.add_scan", 60, 1.0, each=True),
    "while the map so far is saved": Moment(
        "racecar.pipelines.live.saving.unfinished_map:save_session", 1, 2.0
    ),
    "while the map is finished": Moment(f"{MAPPER}._optimize_finally", is_after_end=True),
    "while its files are written": Moment(f"{FILES}:save_session", is_after_end=True),
    "going on with a drive": Moment(f"{NODE}._take_logged", 50, goes_on=True),
}
UNDISTURBED = Moment(f"{NODE}.watch", 10**9)


@contextmanager
def node(
    out: Path, moment: Moment, ros: dict[str, str], terminal: int | None = None
) -> Iterator["subprocess.Popen[bytes]"]:
    """A mapper, on a terminal or with a log beside the map."""
    held = {
        name: value for name, value in asdict(moment).items() if name in ("where", "nth", "seconds", "each")
    }
    told = json.dumps({**held, "reached": str(out.with_name("reached"))})
    words = [sys.executable, "-m", "tests.end_to_end.held_up", told, "live", "map", "--out", str(out)]
    with out.with_name("log").open("ab") as log:
        to = log.fileno() if terminal is None else terminal
        process = subprocess.Popen(words, env=ros, stdout=to, stderr=to)
        try:
            yield process
        finally:
            process.kill()
            process.wait()


def drive_until(there: Path, out: Path, process: "subprocess.Popen[bytes]") -> None:
    """Publish what the car says until a file is there."""
    from racecar.pipelines.live.ros.run import ros_node

    first = recorded()[0][0]
    with ros_node("test_car", []) as driver:
        car, said, began = LiveCar(driver), iter(recorded()), time.monotonic()

        def wait(seconds: float) -> None:
            assert process.poll() is None and time.monotonic() < began + _HANGS, said_by(out)
            time.sleep(max(seconds, 0.0))

        while driver.count_subscribers("/scan") == 0:
            wait(0.05)
        began, shift = time.monotonic(), time.time_ns() - first
        while not there.exists():
            due, message, truth = next(said)
            wait(began + (due - first) * 1e-9 - time.monotonic())
            car.say(message, truth, shift)


def await_moment(out: Path, moment: Moment, process: "subprocess.Popen[bytes]") -> None:
    reached, until = out.with_name("reached"), time.monotonic() + _HANGS
    if moment.is_after_end:
        drive_until(out / "map.yaml", out, process)
        process.send_signal(signal.SIGINT)
    elif moment.has_scans and not moment.goes_on:
        drive_until(reached, out, process)
    while not reached.exists():
        assert process.poll() is None and time.monotonic() < until, said_by(out)
        time.sleep(0.05)


def said_by(out: Path) -> str:
    return out.with_name("log").read_text()


def end_and_kill(process: "subprocess.Popen[bytes]", number: signal.Signals) -> None:
    process.send_signal(number)
    try:
        process.wait(KILLED_AFTER)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def assert_usable(out: Path) -> None:
    """By nav2, which takes the files as they are, and by racecar."""
    header = yaml.safe_load((out / "map.yaml").read_text())
    assert len(header["origin"]) == 3
    assert len(np.unique(np.asarray(Image.open(out / header["image"])))) >= 2
    trajectory = load_tum(out / "trajectory.tum")
    assert (load_map(out).cells > 50).any()
    assert load_session(out).is_of(trajectory)


QUICK = [("driving", signal.SIGHUP), ("while the map is finished", signal.SIGTERM)]
ENDS = [
    pytest.param(when, number, marks=[] if (when, number) in QUICK else pytest.mark.slow)
    for when in MOMENTS
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
]


@pytest.mark.parametrize(("when", "number"), ENDS)
def test_whoever_ends_it_gets_a_map(
    when: str, number: signal.Signals, ros: dict[str, str], tmp_path: Path
) -> None:
    out, moment = tmp_path / "out", MOMENTS[when]
    if moment.goes_on:
        with node(out, MOMENTS["driving"], ros) as process:
            await_moment(out, MOMENTS["driving"], process)
        out.with_name("reached").unlink()
    with node(out, moment, ros) as process:
        await_moment(out, moment, process)
        end_and_kill(process, number)
    assert "Traceback" not in said_by(out)
    if moment.has_scans:
        assert_usable(out)
    else:
        assert not list(out.glob("*")), said_by(out)


def test_a_closed_terminal_ends_the_drive_whose_map_is_finished(ros: dict[str, str], tmp_path: Path) -> None:
    out, (ours, terminal) = tmp_path / "out", pty.openpty()
    with node(out, MOMENTS["driving"], ros, terminal) as process:
        os.close(terminal)
        await_moment(out, MOMENTS["driving"], process)
        os.close(ours)
        process.send_signal(signal.SIGHUP)
        process.wait(_HANGS)
    assert not read_report(out).counts.interrupted
    assert not out.with_name("out.drive.log").exists()
    assert_usable(out)


@pytest.mark.slow
def test_a_long_drive_is_saved_within_three_seconds_of_sigterm(
    ros: dict[str, str], recordings: Path, tmp_path: Path
) -> None:
    """45 minutes, of which the node is told within less than four."""
    from geometry_msgs.msg import PoseStamped

    from racecar.pipelines.live.ros.processes import racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    out, poses = tmp_path / "out", list[float]()
    play = ["play", str(recordings / "slam_benchmark" / "intel.bag"), "--quiet", "--speed", "12"]
    with node(out, UNDISTURBED, ros) as process, ros_node("test_watcher", []) as watcher, served(watcher):
        watcher.create_subscription(
            PoseStamped, "/tracked_pose", lambda _: poses.append(time.monotonic()), 10
        )
        with racecar_process([*play, "--listeners", "1", "--wait", "60"], ros, tmp_path / "play") as player:
            assert player.wait(600.0) == 0
        while time.monotonic() < poses[-1] + 2.0:  # a busy computer maps on
            time.sleep(0.1)
        process.send_signal(signal.SIGTERM)
        time.sleep(3.0)
    assert "Traceback" not in said_by(out)
    assert_usable(out)
    logged = [each.stamp for each in DriveLog(out).entries() if isinstance(each, Scan)]
    mapped = load_session(out)
    assert len(logged) > 13_000 and len(mapped.keyframes) > 1000
    assert logged[-1] - mapped.times.stamps[-1] < 60 * 10**9
