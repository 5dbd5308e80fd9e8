"""``racecar map --batch``: every bag that can be mapped is, once, whatever happens meanwhile."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest

from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.end_to_end.commands import Racecar
from tests.maps.shipped_plans import shipped_plan
from tests.pipelines.bag_samples import write_bag as write_small_bag


def outcomes(out: Path) -> dict[str, str]:
    bags = json.loads((out / "batch.json").read_text())["bags"]
    return {name: row["outcome"] for name, row in bags.items()}


def written(out: Path) -> dict[str, int]:
    """When each map was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob("*/report.json")}


def test_a_broken_bag_is_a_row_and_what_is_done_stays(racecar: Racecar, tmp_path: Path) -> None:
    bags, out = tmp_path / "bags", tmp_path / "maps"
    for folder in ("monday", "tuesday"):
        (bags / folder).mkdir(parents=True)
        write_small_bag(bags / folder / "drive.bag", 100)
    (bags / "broken.bag").write_text("no bag")
    command = ("map", "--batch", bags, "--out", out, "--json", tmp_path / "figures.json")
    done = racecar(*command)
    assert json.loads((tmp_path / "figures.json").read_text())["counts"]["failed"] == 1
    assert set(outcomes(out)) == {"broken", "drive", "tuesday-drive"}
    assert outcomes(out)["broken"] == "failed"
    assert f"{bags / 'broken.bag'} is not a rosbag" in " ".join(done.stdout.split())
    assert "3 bags" in done.stdout
    page = (out / "batch.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 2
    assert "is not a rosbag" in page
    assert sorted(path.name for path in out.iterdir()) == [
        "batch.html",
        "batch.json",
        "drive",
        "tuesday-drive",
    ]

    before = written(out)
    again = racecar(*command, "--quiet", "--strict", code=3)
    assert again.stdout == ""
    assert again.stderr.startswith("broken: ")
    assert again.stderr.count("\n") == 1
    assert written(out) == before

    (bags / "broken.bag").unlink()
    nothing_left = racecar(*command)
    assert "2 of 2 bags are mapped already" in nothing_left.stderr
    assert written(out) == before


def test_a_batch_without_one_map_is_the_users_mistake(racecar: Racecar, tmp_path: Path) -> None:
    (tmp_path / "broken.bag").write_text("no bag")
    done = racecar("map", "--batch", tmp_path / "broken.bag", "--out", tmp_path / "out", "--quiet", code=2)
    assert "is not a rosbag" in done.stderr
    assert "No bag became a map" in done.stderr


def start(*arguments: object, log: Path) -> "subprocess.Popen[bytes]":
    """The command, which hears Ctrl-C even where the tests run in the background and do not."""
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", *map(str, arguments)]
    with log.open("w") as error:
        return subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=error,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )


@pytest.fixture(scope="module")
def twenty_bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with nineteen short drives, and a bag that is cut before its first message."""
    bags = tmp_path_factory.mktemp("bags")
    for seed in range(19):
        simulation = Simulation(shipped_plan("building"), SimulationConfig(seed=seed, duration=6.0))
        write_bag(simulation, bags / f"drive_{seed}.bag", lambda share: None)
    (bags / "cut.bag").write_bytes((bags / "drive_0.bag").read_bytes()[:2000])
    return bags


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_batch_that_was_ended_half_way_goes_on(
    number: signal.Signals, racecar: Racecar, twenty_bags: Path, tmp_path: Path
) -> None:
    out, log = tmp_path / "maps", tmp_path / "log"
    command = ("map", "--batch", twenty_bags, "--out", out)
    running = start(*command, log=log)
    deadline = monotonic() + 600.0
    while log.read_text().count("\n") < 8:
        assert running.poll() is None
        assert monotonic() < deadline
        sleep(0.1)
    running.send_signal(number)
    assert running.wait(60.0) == (-number if number == signal.SIGKILL else 130)
    sleep(3.0)
    before = written(out)
    assert 6 <= len(before) <= 18
    sleep(10.0)
    assert written(out) == before  # those that were at work have ended, too

    racecar(*command)
    assert {name: when for name, when in written(out).items() if name in before} == before
    assert len(written(out)) == 19
    assert [name for name, outcome in outcomes(out).items() if outcome == "failed"] == ["cut"]
    assert len(outcomes(out)) == 20
    assert not list(out.glob(".*"))
