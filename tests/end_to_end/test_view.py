"""``racecar map --record``, ``racecar localize --record`` and ``racecar studio``, as a user runs them."""

import signal
import socket
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Reader

from tests.end_to_end.commands import Racecar
from tests.end_to_end.viewing import SCREEN, pixels_of, viewed
from tests.pipelines.studio.chromium import Tab, new_tab

TOPICS = {"/map", "/scan", "/odom", "/path", "/pf/pose/odom", "/tf", "/tf_static"}


@pytest.fixture(scope="module")
def mapped(racecar: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "map"
    racecar("map", drive / "drive.bag", "--out", out, "--record", "--quiet")
    return out


@pytest.fixture(scope="module")
def localized(racecar: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "localized"
    racecar(
        *("localize", drive / "drive.bag", "--map", "building", "--initial-pose", 0, 0, 0),
        *("--out", out, "--record", "--quiet"),
    )
    return out


def port_of(address: str) -> int:
    return int(address.split(":")[2].split("/")[0])


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
    assert "No problems found" in done.stdout


@pytest.mark.slow
def test_a_browser_shows_map_car_scan_and_path(chromium: Any, localized: Path, tmp_path: Path) -> None:
    with viewed(localized) as address, new_tab(chromium, *SCREEN) as tab:
        tab.goto(address)
        Tab(tab).wait_for(lambda: pixels_of(tab, tmp_path / "view.png").complete, "map, path, scan and car")


@pytest.mark.slow
def test_a_page_whose_server_was_killed_comes_back_with_the_next_one(
    chromium: Any, localized: Path, tmp_path: Path
) -> None:
    with new_tab(chromium, *SCREEN) as tab:
        page = Tab(tab)

        def is_complete() -> bool:
            return pixels_of(tab, tmp_path / "view.png").complete

        with viewed(localized, ended_by=signal.SIGKILL) as address:
            tab.goto(address)
            page.wait_for(is_complete, "the run")
        page.wait_for(lambda: not is_complete(), "an empty page")
        with viewed(localized, port=port_of(address)):
            page.wait_for(is_complete, "the run again")


@pytest.mark.slow
def test_only_this_machine_is_served_and_the_server_ends_with_the_command(mapped: Path) -> None:
    with viewed(mapped) as address:
        port = port_of(address)
        own_address = socket.gethostbyname(socket.gethostname())
        if not own_address.startswith("127."):
            with socket.socket() as outside:
                assert outside.connect_ex((own_address, port)) != 0
        with socket.socket() as inside:
            assert inside.connect_ex(("127.0.0.1", port)) == 0
    with socket.socket() as inside:
        assert inside.connect_ex(("127.0.0.1", port)) != 0
