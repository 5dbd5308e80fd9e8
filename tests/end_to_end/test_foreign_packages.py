"""A sourced ROS workspace may hold packages called localization, mapping, maps or pipelines: racecar runs."""

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

from tests.pipelines.bag_samples import write_bag
from tests.ros_domains import next_domain

ROOMS = ("localization", "mapping", "maps", "pipelines")
REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages that have our rooms' names, and cannot be imported without notice."""
    folder = tmp_path_factory.mktemp("workspace")
    for room in ROOMS:
        (folder / room).mkdir()
        for module in ("__init__", "sensor_model", "motion_model", "particle_filter"):
            (folder / room / f"{module}.py").write_text(
                f"raise ImportError('the foreign {room} was imported')\n"
            )
    return folder


@pytest.fixture(scope="module")
def wheel_command(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """``racecar`` of a fresh environment into which the wheel was installed."""
    folder = tmp_path_factory.mktemp("wheel")
    left_out = shutil.ignore_patterns(".*", "build", "*.egg-info")
    source = shutil.copytree(REPOSITORY, folder / "source", symlinks=True, ignore=left_out)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    build = ("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, source)
    subprocess.run([*pip, *map(str, build)], check=True)
    environment = folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    python = environment / "bin" / "python"
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, f"--python={python}", "install", "--no-deps", str(wheel)], check=True)
    packages = next(environment.glob("lib/python*/site-packages"))
    # The dependencies are those of this environment; its own racecar comes by a hook that is left behind.
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    _bring_compiled_kernels(packages / "racecar")
    where = [str(python), "-I", "-c", "import racecar; print(racecar.__file__)"]
    assert (
        str(packages) in subprocess.run(where, cwd=folder, capture_output=True, text=True, check=True).stdout
    )
    return [str(environment / "bin" / "racecar")]


def _bring_compiled_kernels(installed: Path) -> None:
    """Numba's caches of this checkout serve the same sources elsewhere, when these look as old."""
    for room in ROOMS:
        for source in (REPOSITORY / room).rglob("*.py"):
            copy = installed / room / source.relative_to(REPOSITORY / room)
            os.utime(copy, ns=(source.stat().st_mtime_ns, source.stat().st_mtime_ns))
            for kernel in source.parent.glob(f"__pycache__/{source.stem}.*.nb[ic]"):
                (copy.parent / "__pycache__").mkdir(exist_ok=True)
                shutil.copy2(kernel, copy.parent / "__pycache__")


@pytest.fixture(params=["editable", "wheel"])
def command(request: pytest.FixtureRequest) -> list[str]:
    """``racecar`` as this environment has it, and as the wheel brings it."""
    if request.param == "wheel":
        wheel: list[str] = request.getfixturevalue("wheel_command")
        return wheel
    return [str(Path(sys.executable).parent / "racecar")]


def test_commands_run_beside_packages_of_the_same_names(
    command: list[str], foreign: Path, tmp_path: Path
) -> None:
    environment = {**os.environ, "PYTHONPATH": str(foreign)}

    def run(*arguments: object) -> None:
        done = subprocess.run(
            [*command, *map(str, arguments)], env=environment, cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr

    bag = write_bag(tmp_path / "drive.bag", 60)
    run("map", bag, "--out", "map", "--quiet")
    run("localize", bag, "--map", "map", "--out", "localized", "--quiet")
    assert (tmp_path / "localized" / "trajectory.tum").exists()


def test_a_live_node_runs_beside_packages_of_the_same_names(
    has_ros: None, command: list[str], foreign: Path, tmp_path: Path
) -> None:
    ros = Path(
        sys.prefix
    )  # where ROS came from PyPI its libraries are there, and a sourced one is found anyway
    libraries = [ros / "lib", *sorted(Path(sysconfig.get_path("purelib")).glob("ros_*.libs"))]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(foreign), *filter(None, [os.environ.get("PYTHONPATH")])]),
        "LD_LIBRARY_PATH": os.pathsep.join([*map(str, libraries), os.environ.get("LD_LIBRARY_PATH", "")]),
        "AMENT_PREFIX_PATH": os.environ.get("AMENT_PREFIX_PATH", str(ros)),
        "ROS_DOMAIN_ID": str(next_domain()),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    log = tmp_path / "log"
    node = [*command, "live", "localize", "--map", "building", "--no-memory"]
    with log.open("wb") as said:
        process = subprocess.Popen(node, env=environment, cwd=tmp_path, stdout=said, stderr=said)
    try:
        until = time.monotonic() + 120.0
        while "Nothing has arrived on /scan yet" not in log.read_text():
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < until, log.read_text()
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 0, log.read_text()
    finally:
        process.kill()
        process.wait()
