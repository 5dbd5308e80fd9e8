"""Large packages that serve one purpose are needed for that purpose alone."""

import subprocess
import sys
from pathlib import Path

import pytest

from racecar.pipelines.commands.cli import run
from tests.pipelines.bag_samples import write_bag

_IMPORT_EVERYTHING = """
import sys
from importlib import import_module
from pkgutil import walk_packages

sys.modules.update({"open3d": None})  # whoever imports these fails

import racecar
from racecar.maps.errors import UserError
from racecar.pipelines.live.ros.start import start_ros

try:
    start_ros()
    has_ros = True
except UserError:
    has_ros = False

for module in walk_packages(racecar.__path__, "racecar."):
    if module.name.startswith("racecar.pipelines.live.") and not has_ros:
        continue
    print(module.name, "imported")
    try:
        import_module(module.name)
    except ModuleNotFoundError as error:
        print(module.name, error.name.partition(".")[0])
"""


def test_open3d_is_imported_nowhere() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _IMPORT_EVERYTHING], capture_output=True, text=True, timeout=300, check=True
    )
    found = dict(line.split() for line in done.stdout.splitlines())
    failed = {module: package for module, package in found.items() if package != "imported"}
    assert {"racecar.pipelines.files.point_map", "racecar.mapping.mapper"} <= found.keys()
    assert failed == {}


def test_a_ply_without_open3d_is_refused_before_the_map_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, out = write_bag(tmp_path / "drive.bag", 20), tmp_path / "out"
    monkeypatch.setitem(sys.modules, "open3d", None)
    assert run(["map", str(bag), "--out", str(out), "--ply"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "open3d is not installed; `pip install '.[full]'` in the clone of racecar-slam" in said
    assert not out.exists()
