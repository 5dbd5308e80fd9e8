"""The commands of README, home page and how-to pages work as they are written, in a fresh clone."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from racecar.pipelines.live.ros.processes import private_environment
from tests.checks.documentation import PAGES, REPOSITORY, blocks
from tests.ros_domains import next_domain

RUN_PAGES = (
    PAGES[0],
    REPOSITORY / "docs" / "index.md",
    *sorted((REPOSITORY / "docs" / "how-to").glob("*.md")),
)
_PREREQUISITES = "racecar map examples/drive.mcap --out runs/drive --quiet"
"""What a page may suppose that was done before, on the home page."""
_OF_A_READER = {
    "nav2_params.yaml": "amcl_params.yaml",
    "mapper_params_online_async.yaml": "slam_toolbox_params.yaml",
}
"""Files of a reader's own that pages name, and what stands for them."""
_ENDLESS = re.compile(r"^racecar (studio|mend|live (map|localize|simulate))\b")
"""Until Ctrl-C."""
_NEEDS_ROS = re.compile(r"^racecar (live (?!files)|play)")
_NOT_HERE = re.compile(
    r"^(git clone|make|pip) "  # .ci/run makes and installs; a clone is what the fixture stands for
    r"|^(ros2|ln|cd|ssh) "  # ROS from PyPI has no ros2; a colcon workspace, and another computer
    r"|--(scheduler|plan|relations) "  # a cluster, a floor plan and relations of a reader's own
    r"|/front |stata_basement|\bdrive\.bag\b|\bcheck drive$|\bevaluate drive:"  # a car of a reader's own
    r"|^racecar experiment "  # hours; test_experiment.py runs them with --quick
    r"|^racecar demo "  # test_warm_up.py runs it
    r"|--help|--install-completion"  # nothing to see, and the settings of a shell
)
"""Commands whose flags alone are checked, by `tests.checks`."""
_LIVE_SECONDS, _LONGEST_SECONDS = 30.0, 1800.0


def commands(page: Path) -> Iterator[str]:
    """The lines of a page's shell blocks that can be run here, without their comments."""
    for block in blocks(page):
        if block.language == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                command = re.sub(r"\s+#.*$", "", line).strip()
                if command and not _NOT_HERE.search(command):
                    yield command


def files_of_the_repository() -> list[str]:
    listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    done = subprocess.run(listed, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("this is no clone of git")
    return [name for name in done.stdout.split("\0") if name and os.path.lexists(REPOSITORY / name)]


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Where `racecar` is that of the clone, and ROS talks to nobody else."""
    folder = tmp_path_factory.mktemp("bin")
    command = folder / "racecar"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m racecar.pipelines.commands.cli "$@"\n')
    command.chmod(0o755)
    path = os.pathsep.join((str(folder), os.environ["PATH"]))
    own = {"PATH": path, "BROWSER": "true", "XDG_STATE_HOME": str(folder / "state"), "MPLBACKEND": "agg"}
    return {**os.environ, **private_environment(next_domain()), **own}


@pytest.fixture(scope="module")
def mapped_clone(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What git would hand out, what a reader has already, and the map of the home page."""
    clone = tmp_path_factory.mktemp("mapped") / "racecar-slam"
    for name in files_of_the_repository():
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(REPOSITORY / name, clone / name, follow_symlinks=False)
    for name, ours in _OF_A_READER.items():
        shutil.copy2(REPOSITORY / "tests" / "pipelines" / "live" / ours, clone / name)
    run(_PREREQUISITES, clone, environment)
    return clone


def run(command: str, folder: Path, environment: dict[str, str]) -> None:
    """As a user types it; Ctrl-C ends what would go on for ever."""
    is_endless = _ENDLESS.search(command) is not None
    process = subprocess.Popen(
        ("bash", "-c", command if "&&" in command else f"exec {command}"),
        cwd=folder,
        env={**environment, "PYTHONPATH": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        said, _ = process.communicate(timeout=_LIVE_SECONDS if is_endless else _LONGEST_SECONDS)
        assert not is_endless, f"{command} ended by itself: {said}"
    except subprocess.TimeoutExpired:
        assert is_endless, f"{command} takes too long"
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=_LONGEST_SECONDS)
    finally:
        process.kill()
    assert process.returncode in ((0, 130) if is_endless else (0,)), f"{command}: {said}"
    assert "Traceback" not in said, f"{command}: {said}"


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN_PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_page_work_as_they_are_written(
    page: Path,
    mapped_clone: Path,
    environment: dict[str, str],
    tmp_path: Path,
) -> None:
    clone = tmp_path / "racecar-slam"
    shutil.copytree(mapped_clone, clone, symlinks=True)
    lines = list(commands(page))
    if page in RUN_PAGES[:2] or _maps_first(lines):
        shutil.rmtree(clone / "runs")
    for command in lines:
        if not _NEEDS_ROS.search(command):
            run(command, clone, environment)
        elif find_spec("rclpy") is not None:
            _run_live(command, clone, environment)


def _maps_first(lines: list[str]) -> bool:
    """Whether the page makes the map itself."""
    return any(line.startswith("racecar map examples/drive.mcap --out runs/drive") for line in lines)


def _run_live(command: str, clone: Path, environment: dict[str, str]) -> None:
    """While a recording is played; what is mapped live on a page, others of it localize on."""
    lab = clone / "runs" / "lab"
    if " live map " in command:
        shutil.rmtree(lab, ignore_errors=True)
    elif "runs/lab" in command and not lab.exists():
        shutil.copytree(clone / "runs" / "drive", lab)
    played = None
    if " live simulate " not in command and " play " not in command:
        words = ("racecar", "play", "examples/drive.mcap", "--quiet")
        played = subprocess.Popen(words, cwd=clone, env={**environment, "PYTHONPATH": str(clone)})
    try:
        run(command, clone, environment)
    finally:
        if played is not None:
            played.kill()
            played.wait()


def test_most_commands_are_run() -> None:
    assert sum(1 for page in RUN_PAGES for _ in commands(page)) >= 40
