"""What users get wrong: one sentence, exit code 2, nothing half-written."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.grid.occupancy_grid import OCCUPIED, OccupancyGrid
from racecar.maps.map_files import save_map
from racecar.pipelines.commands.cli import run
from tests.end_to_end.commands import Racecar, assert_refused, report_of

MAP_YAML = (
    "image: {}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
)
FILES = {
    "empty.bag": "",
    "text.bag": "This is no bag.\n" * 100,
    "empty.mcap": "",
    "text.db3": "neither",
    "unknown.txt": "x",
    "secret.pgm": "P5 2 2 255\n....",
    "maps/missing.yaml": MAP_YAML.format("missing.pgm"),
    "maps/above.yaml": MAP_YAML.format("../secret.pgm"),
    "maps/far.yaml": MAP_YAML.format("/etc/hostname"),
    "typo.yaml": "localization:\n  particels: 100\n",
    "short.tum": "1.0 0 0 0 0 0 0 1\n1.0 2.0\n",
    "words.tum": "1.0 0 0 0 0 0 0 1\na b c d e f g h\n",
}
NO_BAGS = ("empty.bag", "text.bag", "empty.mcap", "text.db3", "unknown.txt", "absent.bag")
SCHEDULER = ("--scheduler", "tcp://localhost:1")

MISTAKES: list[tuple[tuple[str, ...], str]] = [
    *(((command, name), name) for command in ("map", "check") for name in NO_BAGS),
    (("localize", "absent.bag", "--map", "track"), "absent.bag"),
    *(
        (("map", "drive.bag", flag, "/scna"), topic)
        for flag in ("--scan-topic", "--odom-topic")
        for topic in ("/scan", "/odom")
    ),
    *(
        (("localize", "drive.bag", "--map", f"maps/{name}.yaml", "--global"), words)
        for name, words in {"missing": "missing.pgm", "above": "secret.pgm", "far": "hostname"}.items()
    ),
    (("map", "drive.bag", "--config", "typo.yaml"), "did you mean 'localization.particles'"),
    *(
        (("evaluate", *arguments), "line 2 of")
        for bad in ("short.tum", "words.tum")
        for arguments in (
            (bad, "--reference", "drive.ground_truth.tum"),
            ("drive.ground_truth.tum", "--reference", bad),
            ("drive.ground_truth.tum", "--relations", bad),
        )
    ),
    (("map",), "give a BAG"),
    (("map", "a.bag", "--batch", "list"), "not both"),
    (("map", "a.bag", "--jobs", "2"), "are for many bags"),
    (("map", "--batch", "list", "--continue", "run"), "racecar merge"),
    (("map", "--batch", "list", "--jobs", "2", *SCHEDULER), "--jobs is for this machine"),
    (("map", "--batch", "nowhere.txt"), "Cannot read nowhere.txt"),
    (("map", "drive.bag", "--initial-pose", "0", "0", "0"), "earlier map"),
    (("map", "drive.bag", "--continue", "maps"), "no session.npz"),
]


@pytest.fixture(scope="module")
def home(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with a drive and all that can be wrong beside it."""
    home = shutil.copytree(drive, tmp_path_factory.mktemp("mistakes") / "home")
    for name, content in FILES.items():
        (home / name).parent.mkdir(exist_ok=True)
        (home / name).write_text(content)
    return home


@pytest.mark.parametrize(("arguments", "words"), MISTAKES)
def test_a_mistake_is_one_sentence(
    arguments: tuple[str, ...], words: str, racecar: Racecar, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(home)
    out = () if arguments[0] in ("check", "evaluate") else ("--out", "out", "--quiet")
    assert_refused(racecar(*arguments, *out, code=2), words, home / "out")


LOCALIZE, SIMULATE = ("live", "localize", "--map", "building"), ("live", "simulate", "--map", "track")
LIVE_MISTAKES: list[tuple[tuple[str, ...], str]] = [
    (("live", "localize", "--map", "nowhere"), "There is no map at"),
    ((*LOCALIZE, "--global", "--initial-pose", "0", "0", "0"), "exclude"),
    ((*LOCALIZE, "--initial-pose", "999", "0", "0"), "free space"),
    ((*LOCALIZE, "--ros-args", "-p", "tf:=maybe"), "parameter tf"),
    ((*LOCALIZE, "--ros-args", "-p", "particles:=none"), "particles"),
    ((*LOCALIZE, "--ros-args", "--nonsense"), "ROS does not start"),
    (("live", "localize", "--mop", "building"), "No such option"),
    (("live", "map", "--out", "/proc/nowhere"), "Cannot write"),
    (("live", "map", "--out", "x", "--ros-args", "-p", "laser_pose:=[1.0, 2.0]"), "laser_pose"),
    ((*SIMULATE, "--start", "100", "0", "0"), "The car cannot start at 100 0 0; the nearest place"),
    ((*SIMULATE, "--start", "-0.1", "1.05", "0"), "The car cannot start at -0.1 1.05 0; the nearest place"),
    ((*SIMULATE, "--start", "nan", "0", "0"), "The car cannot start at nan 0 0"),
    ((*SIMULATE, "--namespace", "no good"), "ROS does not start"),
    (("live", "simulate", "--map", "nowhere"), "no map at nowhere"),
    ((*SIMULATE, "--ros-args", "-p", "walkers:=-1"), "walkers"),
    (("live", "simulate", "--map", "solid"), "no room"),
]


@pytest.mark.usefixtures("ros")
@pytest.mark.parametrize(("arguments", "words"), LIVE_MISTAKES)
def test_a_mistake_at_the_start_of_a_node_is_told_in_words(
    arguments: tuple[str, ...],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("solid").mkdir()
    walls = np.full((40, 40), OCCUPIED, dtype=np.int8)
    save_map(OccupancyGrid(walls, 0.05, np.zeros(3)), Path("solid", "map.yaml"))
    assert run(list(arguments)) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert words in told
    assert "Traceback" not in told


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_cut_bag_gives_the_map_of_what_is_left(
    racecar: Racecar, drive: Path, tmp_path: Path, share: float
) -> None:
    contents = (drive / "drive.bag").read_bytes()
    cut, out = tmp_path / "cut.bag", tmp_path / "out"
    cut.write_bytes(contents[: int(share * len(contents))])
    done = racecar("map", cut, "--out", out)
    assert "Traceback" not in done.stderr
    report = report_of(out)
    assert report["warnings"]
    assert report["counts"]["scans"] > share * 6 * 40 * 0.8


def test_out_that_is_a_file(racecar: Racecar, drive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.write_text("mine")
    done = racecar("map", drive / "drive.bag", "--out", out, code=2)
    assert "is a file" in done.stderr
    assert out.read_text() == "mine"
