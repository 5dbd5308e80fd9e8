"""What the light install needs has wheels for the computers of cars, so that nothing is compiled there."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

tomllib = pytest.importorskip("tomllib")  # from Python 3.11 on

REPOSITORY = Path(__file__).parents[2]
GLIBC = ("2_35", "2_34", "2_31", "2_28", "2_27", "2_17")
"""Of Ubuntu 22.04, as on a Jetson with JetPack 6, and of what is older."""

_UNREACHABLE = ("NewConnectionError", "ConnectTimeoutError", "Temporary failure in name resolution")


def requirements(version: str, machine: str) -> list[str]:
    """Of the light install there; pip itself asks markers about the machine it runs on."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    there = {
        "python_version": version,
        "python_full_version": f"{version}.0",
        "platform_machine": machine,
        "sys_platform": "linux",
    }
    parsed = [Requirement(text) for text in project["dependencies"]]
    return [
        f"{each.name}{each.specifier}"
        for each in parsed
        if each.marker is None or each.marker.evaluate(there)
    ]


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
@pytest.mark.parametrize("version", ["3.10", "3.11", "3.12", "3.13"])
def test_one_gtsam_is_asked_for(version: str, machine: str) -> None:
    (gtsam,) = (each for each in requirements(version, machine) if each.startswith("gtsam"))
    assert gtsam == ("gtsam==4.3a1" if (version, machine) == ("3.10", "aarch64") else "gtsam>=4.2")


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
@pytest.mark.parametrize("version", ["3.10", "3.11", "3.12", "3.13"])
def test_pip_finds_wheels_for_all_of_it(version: str, machine: str, tmp_path: Path) -> None:
    tag = version.replace(".", "")
    platforms = [f"--platform=manylinux_{glibc}_{machine}" for glibc in (*GLIBC, "2_12", "2_5")]
    platforms += [f"--platform=manylinux{year}_{machine}" for year in ("2014", "2010", "1")]
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet"]
    command += ["--only-binary=:all:", "--implementation=cp", f"--python-version={version}", f"--abi=cp{tag}"]
    command += ["--abi=abi3", "--abi=none", *platforms, f"--target={tmp_path / 'nowhere'}"]
    command += [f"--report={tmp_path / 'report.json'}", "--disable-pip-version-check"]
    asked = requirements(version, machine)
    done = subprocess.run([*command, *asked], capture_output=True, text=True, check=False)
    if any(sign in done.stderr for sign in _UNREACHABLE):
        pytest.skip("there is no package registry to ask")
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "report.json").read_text())
    found = {each["metadata"]["name"].lower().replace("_", "-") for each in report["install"]}
    assert {Requirement(each).name.lower().replace("_", "-") for each in asked} <= found
    assert not found & {"evo", "matplotlib", "open3d", "viser"}
