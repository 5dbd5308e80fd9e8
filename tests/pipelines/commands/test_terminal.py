"""What reaches the terminal, whatever it knows and whoever reads; each in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture
def trajectory(tmp_path: Path) -> Path:
    path = tmp_path / "a.tum"
    path.write_text("".join(f"{i * 0.025} {i * 0.1} 0 0 0 0 0 1\n" for i in range(50)))
    return path


def racecar(*arguments: str | bytes, **more: object) -> "subprocess.CompletedProcess[bytes]":
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli", *arguments]
    return subprocess.run(command, stderr=subprocess.PIPE, check=False, **more)  # type: ignore[call-overload, no-any-return]


def test_a_terminal_that_knows_ascii_only(trajectory: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    arguments = ["evaluate", str(trajectory), "--reference", str(trajectory)]
    done = racecar(*arguments, stdout=subprocess.PIPE, env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"absolute heading ( deg)" in done.stdout


def test_names_that_are_no_text(trajectory: Path) -> None:
    name = os.path.join(os.fsencode(trajectory.parent), b"\xff\xe4.tum")  # noqa: PTH118 (bytes)
    os.rename(trajectory, name)  # noqa: PTH104
    figures = os.path.join(os.fsencode(trajectory.parent), b"\xff.json")  # noqa: PTH118
    done = racecar("evaluate", name, "--reference", name, "--json", figures, stdout=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (0, b"")
    with open(figures, encoding="utf-8") as file:  # noqa: PTH123
        assert '"matched_share": 1.0' in file.read()


def test_nobody_reads_to_the_end(trajectory: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = racecar("evaluate", str(trajectory), "--reference", str(trajectory), stdout=writing)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_the_output_goes_to_a_full_disk(trajectory: Path) -> None:
    with open("/dev/full", "wb") as full:  # noqa: PTH123
        done = racecar("evaluate", str(trajectory), "--reference", str(trajectory), stdout=full)
    assert done.returncode == 2
    assert done.stderr == b"Cannot write a file: no space left on device.\n"


def test_the_output_is_closed(trajectory: Path) -> None:
    cli = f"{sys.executable} -m racecar.pipelines.commands.cli"
    command = f"{cli} evaluate {trajectory} --reference {trajectory} >&-"
    done = subprocess.run(["sh", "-c", command], stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
