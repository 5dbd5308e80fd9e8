import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import racecar
from racecar.maps.errors import UserError
from racecar.pipelines.commands import cli

COMMANDS = ("map", "localize", "evaluate", "simulate", "check", "config", "studio", "demo")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_shows_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([command, "--help"]) == 0
    assert f"Example: racecar {command}" in capsys.readouterr().out


def test_help_without_arguments(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([]) == 0
    shown = capsys.readouterr().out
    assert all(command in shown for command in COMMANDS)
    assert "Exit codes: 0 done" in shown


def test_its_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"racecar {racecar.__version__}\n"


@pytest.mark.parametrize("command", [[], ["map"], ["live", "localize"], ["experiment"]])
def test_help_has_a_short_name(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([*command, "-h"]) == 0
    short = capsys.readouterr().out
    assert cli.run([*command, "--help"]) == 0
    assert capsys.readouterr().out == short


def test_a_paragraph_of_help_is_one_line_until_the_terminal_wraps_it() -> None:
    for group in (cli.app, *(child.typer_instance for child in cli.app.registered_groups)):
        assert group is not None
        for command in group.registered_commands:
            assert command.help
            assert not any("\n" in paragraph for paragraph in command.help.split("\n\n"))


@pytest.mark.parametrize(
    ("words", "completed"),
    [("racecar loc", ["localize"]), ("racecar map --con", ["--config", "--continue"])],
)
def test_the_shell_can_complete_commands_and_flags(words: str, completed: list[str]) -> None:
    environment = {
        **os.environ,
        "_RACECAR_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    command = [sys.executable, "-m", "racecar.pipelines.commands.cli"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split(), done.stderr) == (0, completed, "")


def test_help_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'numba', 'gtsam', 'matplotlib', 'rosbags', 'evo', 'open3d', 'scipy'}"
    code = (
        "import sys; from racecar.pipelines.commands import cli; cli.run([]); "
        f"sys.exit(bool({heavy} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=False)
    assert done.returncode == 0


@pytest.mark.parametrize("command", [["map"], ["localize", "--map", "building"]])
def test_a_wrong_path_is_told_before_anything_heavy_is_loaded(command: list[str], tmp_path: Path) -> None:
    arguments = [*command, str(tmp_path / "no.bag"), "--out", str(tmp_path / "run")]
    heavy = "{'numba', 'gtsam', 'matplotlib', 'evo', 'open3d', 'scipy'}"
    code = (
        f"import sys; from racecar.pipelines.commands import cli; code = cli.run({arguments}); "
        f"sys.exit(code != 2 or bool({heavy} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.DEVNULL, check=False)
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["mapp"], "No such command"),
        (["evaluate"], "Missing argument 'TRAJ'"),
        (["evaluate", "a.tum", "--refrence", "b.tum"], "--refrence"),
        (["evaluate", "a.tum"], "--reference REF or --relations FILE"),
        (["evaluate", "a.tum", "--reference", "b.tum"], "Cannot read b.tum"),
        (
            ["evaluate", "b.tum", "--reference", "a\nb\x1b[2J\udcff.tum"],
            "Cannot read a b?[2J?.tum: no such file or directory.",
        ),
        (["map", "drive.bag", "--out", ""], "The value after --out is empty"),
        (["map", "drive.bag", "--out="], "The value after --out is empty"),
        (["check", " "], "The value after check is empty"),
    ],
)
def test_mistakes_of_the_user(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(arguments) == 2
    shown = capsys.readouterr()
    assert complaint in shown.err
    assert shown.err.count("\n") == 1
    assert shown.out == ""


@pytest.mark.parametrize(
    ("error", "code", "complaint"),
    [
        (UserError("The bag is empty."), 2, "The bag is empty.\n"),
        (MemoryError(), 2, "There is not enough memory for this"),
        (KeyboardInterrupt(), 130, "Stopped.\n"),
        (
            OSError(errno.ENOSPC, "No space left on device", "map.pgm"),
            2,
            "Cannot write map.pgm: no space left",
        ),
        (ZeroDivisionError("float\ndivision"), 1, "fault in racecar"),
        (FileNotFoundError(errno.ENOENT, "No such file", "x"), 1, "fault in racecar"),
    ],
)
def test_exit_codes(
    error: BaseException,
    code: int,
    complaint: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.delenv("RACECAR_DEBUG", raising=False)
    assert cli.run(["demo"], fail) == code
    shown = capsys.readouterr().err
    assert complaint in shown
    assert shown.count("\n") == 1
    monkeypatch.setenv("RACECAR_DEBUG", "1")
    if isinstance(error, UserError):
        with pytest.raises(UserError):
            cli.run(["demo"], fail)


def test_figures_of_an_evaluation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.tum"
    path.write_text("".join(f"{i * 0.025} {i * 0.1} 0 0 0 0 0 1\n" for i in range(50)))
    arguments = ["evaluate", str(path), "--reference", str(path), "--json", str(tmp_path / "figures.json")]
    assert cli.run(arguments) == 0
    assert "50 of 50 poses" in capsys.readouterr().out
    assert '"matched_share": 1.0' in (tmp_path / "figures.json").read_text()


def test_the_title_of_a_table_does_not_break_a_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"{'a long name of a run ' * 4}.tum"
    path.write_text("".join(f"{i * 0.025} {i * 0.1} 0 0 0 0 0 1\n" for i in range(50)))
    monkeypatch.setenv("COLUMNS", "60")
    assert cli.run(["evaluate", str(path), "--reference", str(path)]) == 0
    assert f"{path} against {path}\n" in capsys.readouterr().out
