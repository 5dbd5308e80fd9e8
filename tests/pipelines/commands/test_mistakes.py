"""Mistakes that users make are answered by a sentence that says how to mend them, and exit code 2."""

from pathlib import Path

import pytest

from racecar.pipelines.commands.cli import run

FILES = {
    "empty.bag": "",
    "a.tum": "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n",
    "relations": "1 2 1 0 0 0 0 0\n",
    "swapped.yaml": "localization: {particles: 100, fewest_particles: 200}\n",
    "short.csv": "t,x,y,yaw\n1,0,0,0\n2,0,0\n",
    "twice.csv": "t,x,y,yaw,X\n1,0,0,0,0\n2,0,0,0,0\n",
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).write_text(text)


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        ("check empty.bag", "empty.bag is empty: record or copy it again."),
        ("check /dev/null", "/dev/null is neither a file nor a folder; give a rosbag."),
        ("map empty.bag --batch list.txt --out out", "Give empty.bag or --batch, not both; a list for"),
        (
            "map --batch list.txt --out out --continue run",
            "--continue and --initial-pose are for one bag; `racecar merge` joins the maps",
        ),
        ("merge run --out out", "There is nothing to merge: name two folders or more"),
        ("merge run run --out out", "There is nothing to merge: name two folders or more"),
        ("studio run --map building", "Give a run to look at or --map to drive on, and not both."),
        (
            "evaluate a.tum a.tum --relations relations",
            "--relations measures one trajectory, and draws nothing; give --reference REF.",
        ),
        (
            "evaluate a.tum --relations relations --plot a.png",
            "--relations measures one trajectory, and draws nothing; give --reference REF.",
        ),
        (
            "evaluate a.tum --reference short.csv",
            "There are 3 values in line 3 of short.csv, and 4 columns; write one value for each.",
        ),
        ("evaluate a.tum --reference twice.csv", "Several columns of twice.csv could be x: x, X; keep one"),
        (
            "config --check swapped.yaml",
            "has more 'localization.fewest_particles' (200) than 'localization.particles' (100), "
            "which are the most; swap them.",
        ),
    ],
)
def test_a_mistake_is_explained(command: str, sentence: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(command.split()) == 2
    said = " ".join(capfd.readouterr().err.split())
    assert sentence in said
