"""On the car: what maps and localizes there needs none of the packages of the extra ``full``."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from racecar.pipelines.commands.cli import run
from racecar.pipelines.files import optional_packages
from racecar.pipelines.files.optional_packages import OPTIONAL
from tests.pipelines.bag_samples import write_bag

_WITHOUT_THEM = f"""
import sys

sys.modules.update(dict.fromkeys({OPTIONAL!r}))  # whoever imports these fails

from racecar.pipelines.commands.cli import run

sys.exit(run(sys.argv[1:]))
"""
_NODES = f"""
import sys
from importlib import import_module

sys.modules.update(dict.fromkeys({OPTIONAL!r}))

from racecar.maps.errors import UserError
from racecar.pipelines.live.ros.start import start_ros

try:
    start_ros()
except UserError:
    sys.exit(77)
for node in ("localizer_node", "mapper_node", "saving.map_saving", "player"):
    import_module("racecar.pipelines.live." + node)
"""


def without_them(*arguments: object) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", _WITHOUT_THEM, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a bag was mapped, and localized on that map."""
    folder = tmp_path_factory.mktemp("light")
    bag = write_bag(folder / "drive.bag", 60)
    mapped = without_them("map", bag, "--out", folder / "map")
    assert mapped.returncode == 0, mapped.stderr
    assert "map.png was not drawn, because matplotlib is not installed" in mapped.stderr
    assert f"Written to {folder / 'map'}: map.pgm, map.yaml" in mapped.stdout
    localized = without_them("localize", bag, "--map", folder / "map", "--out", folder / "localized")
    assert localized.returncode == 0, localized.stderr
    return folder


def test_a_map_lacks_its_picture_alone(runs: Path) -> None:
    whole = runs / "whole"
    assert run(["map", str(runs / "drive.bag"), "--out", str(whole), "--quiet"]) == 0
    names = {path.name for path in (runs / "map").iterdir()}
    assert names == {path.name for path in whole.iterdir()} - {"map.png"}
    for name in names - {"report.json"}:
        assert (runs / "map" / name).read_bytes() == (whole / name).read_bytes(), name


def test_the_poses_are_the_same(runs: Path) -> None:
    arguments = ["--map", str(runs / "map"), "--out", str(runs / "whole_poses"), "--quiet"]
    assert run(["localize", str(runs / "drive.bag"), *arguments]) == 0
    written = [(runs / name / "trajectory.tum").read_bytes() for name in ("localized", "whole_poses")]
    assert written[0] == written[1]
    warnings = json.loads((runs / "localized" / "report.json").read_text())["warnings"]
    assert any("overlay.png was not drawn" in sentence for sentence in warnings)
    assert any("not compared" in sentence and "evo is not" in sentence for sentence in warnings)


def test_the_nodes_load() -> None:
    done = subprocess.run([sys.executable, "-c", _NODES], capture_output=True, text=True, check=False)
    if done.returncode == 77:
        pytest.skip("there is no ROS 2 here")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (("studio", "map"), "viser"),
        (("evaluate", "map/trajectory.tum", "--reference", "map/trajectory.tum"), "evo"),
        (("experiment", "sensor-model", "--out", "figures"), "matplotlib"),
        (("render", "map", "--out", "drawn", "--dxf"), "ezdxf"),
    ],
)
def test_what_needs_more_says_what_to_install(
    runs: Path, arguments: tuple[str, ...], package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(runs)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    done = without_them(*arguments)
    assert done.returncode == 2
    assert (
        f"{package} is not installed; `pip install '.[full]'` in the clone of racecar-slam installs it."
        in done.stderr
    )
    assert done.stderr.count("\n") == 1


def test_the_demo_says_so_before_minutes_are_spent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(optional_packages, "find_spec", lambda name: None)
    monkeypatch.setattr("racecar.pipelines.runs.demo_run.run_demo", lambda *_, **__: pytest.fail("driven"))
    assert run(["demo", "--out", str(tmp_path / "demo")]) == 2
    assert "The demo needs a package: evo" in capsys.readouterr().err
