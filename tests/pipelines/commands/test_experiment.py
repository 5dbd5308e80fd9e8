"""Mistakes at ``racecar experiment``."""

from pathlib import Path

import pytest

from racecar.pipelines.cli import run


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("all", "--bag", "drive.bag"), "--bag and --map go together"),
        (("real-run", "drive.bag", "--map", "building", "--end-pose", "1"), "--end-pose is '1'"),
        (("real-run", "missing.bag", "--map", "building"), "missing.bag"),
        (("convergence", "--bag", "missing.bag", "--map", "building"), "missing.bag"),
        (("noise-sweep", "--config", "missing.yaml"), "missing.yaml"),
    ],
)
def test_mistakes_are_one_sentence_and_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], complaint: str
) -> None:
    assert run(["experiment", *arguments, "--out", str(tmp_path / "out"), "--quiet"]) == 2
    shown = capsys.readouterr()
    assert complaint in shown.err
    assert shown.err.count("\n") == 1
    assert shown.out == ""
    assert not (tmp_path / "out").exists()
