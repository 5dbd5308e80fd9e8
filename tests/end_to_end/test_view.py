"""``racecar map --record``, ``racecar localize --record`` and ``racecar view``, as a user runs them."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, open_browser
from numpy.typing import NDArray
from PIL import Image
from rosbags.rosbag2 import Reader

Racecar = Callable[..., "subprocess.CompletedProcess[str]"]
TOPICS = {"/map", "/scan", "/odom", "/path", "/pf/pose/odom", "/tf", "/tf_static"}
PATH, PARTICLE, SCAN = (0, 114, 178), (204, 121, 167), (230, 159, 0)
WALL = (27, 31, 36)
START_SECONDS = 90


@pytest.fixture(scope="module")
def mapped(racecar: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "map"
    done = racecar("map", drive / "drive.bag", "--out", out, "--record", "--quiet")
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def localized(racecar: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "localized"
    done = racecar(
        *("localize", drive / "drive.bag", "--map", "building", "--initial-pose", 0, 0, 0),
        *("--out", out, "--record", "--quiet"),
    )
    assert done.returncode == 0, done.stderr
    return out


def messages_by_topic(run: Path) -> dict[str, int]:
    with Reader(run / "record") as reader:
        return {connection.topic: connection.msgcount for connection in reader.connections}


def test_a_mapping_run_is_recorded(mapped: Path) -> None:
    counts = messages_by_topic(mapped)
    assert set(counts) == TOPICS
    assert (
        counts["/scan"]
        == counts["/pf/pose/odom"]
        == len((mapped / "trajectory.tum").read_text().splitlines())
    )


def test_a_localization_run_is_recorded(localized: Path) -> None:
    counts = messages_by_topic(localized)
    assert set(counts) == {*TOPICS, "/pf/viz/particles"}
    assert counts["/scan"] == len((localized / "trajectory.tum").read_text().splitlines())
    assert counts["/pf/viz/particles"] == pytest.approx(counts["/scan"] / 4, rel=0.1)


def test_a_recording_is_a_bag_like_any_other(racecar: Racecar, localized: Path) -> None:
    done = racecar("check", localized / "record")
    assert done.returncode == 0, done.stderr
    assert "Nothing is wrong" in done.stdout


def test_runs_become_rerun_recordings(
    racecar: Racecar, mapped: Path, localized: Path, tmp_path: Path
) -> None:
    for run in (mapped, localized):
        done = racecar("view", run, "--save", tmp_path / f"{run.name}.rrd")
        assert done.returncode == 0, done.stderr
        assert (tmp_path / f"{run.name}.rrd").stat().st_size > 100_000


@contextmanager
def viewed(run: Path) -> Iterator[str]:
    """The address of a running ``racecar view``."""
    command = [sys.executable, "-m", "pipelines.cli", "view", str(run), "--no-browser"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert process.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:\S+", process.stdout.readline())
        assert found is not None
        yield found[0]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


def pixels(browser: Browser, path: Path) -> NDArray[np.int64]:
    """(rows, columns, 3) of what the browser shows."""
    browser.screenshot(path)
    return np.asarray(Image.open(path).convert("RGB")).astype(np.int64)


def count(picture: NDArray[np.int64], color: tuple[int, int, int], within: int = 40) -> int:
    """How many pixels are nearly of a colour."""
    return int(np.count_nonzero(np.abs(picture - color).max(axis=2) < within))


@pytest.mark.slow
def test_a_browser_shows_map_particles_scan_and_path(localized: Path, tmp_path: Path) -> None:
    wanted = {"walls": WALL, "path": PATH, "particles": PARTICLE, "scan": SCAN}
    with viewed(localized) as address, open_browser() as browser:
        browser.open(address)

        def shows_all() -> bool:
            picture = pixels(browser, tmp_path / "view.png")
            return all(count(picture, color) > 20 for color in wanted.values())

        browser.wait_until(shows_all, START_SECONDS, "the map, the path, the scan and the particles")
        assert any(address.startswith("http://127.0.0.1") for address in browser.requests)


@pytest.mark.slow
def test_only_this_machine_is_served_and_the_server_ends_with_the_command(mapped: Path) -> None:
    import socket

    with viewed(mapped) as address:
        port = int(address.split(":")[2].split("/")[0])
        own_address = socket.gethostbyname(socket.gethostname())
        if not own_address.startswith("127."):
            with socket.socket() as outside:
                assert outside.connect_ex((own_address, port)) != 0
        with socket.socket() as inside:
            assert inside.connect_ex(("127.0.0.1", port)) == 0
    with socket.socket() as inside:
        assert inside.connect_ex(("127.0.0.1", port)) != 0
