"""``racecar experiment``: commands that are made from the catalogue, and mistakes at them."""

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.experiment import add_command
from racecar.pipelines.experiments.catalogue import CATALOGUE, ExperimentEntry, Uses
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.runs.parallel_runs import ParallelRuns


@pytest.mark.parametrize("entry", CATALOGUE, ids=lambda entry: entry.name)
def test_each_entry_has_a_module_and_a_command(
    entry: ExperimentEntry, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(entry.load())
    assert run(["experiment", entry.name, "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert f"Example: racecar experiment {entry.name}" in shown
    assert ("--seed" in shown) == (Uses.SETTINGS in entry.uses)
    assert ("--scheduler" in shown) == (Uses.REPETITIONS in entry.uses)
    assert ("--initial-pose" in shown) == bool(entry.uses & (Uses.RECORDING | Uses.EXTRA_RECORDING))


def test_an_entry_is_all_that_a_command_takes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sensor model's pictures under another name, whose experiment notes what it was given."""
    entry = ExperimentEntry("seen-again", Uses.REPETITIONS, "Again.", "--out runs/again")
    given: list[ExperimentSettings] = []

    def load(self: ExperimentEntry) -> object:
        from racecar.pipelines.experiments.sensor_model import sensor_model

        def seen_again(settings: ExperimentSettings, parallel: ParallelRuns) -> object:
            given.append(settings)
            return sensor_model(settings, parallel)

        return seen_again

    monkeypatch.setattr(ExperimentEntry, "load", load)
    app = typer.Typer()
    add_command(app, entry.name, entry.uses, entry.help, entry.example, [entry])
    done = CliRunner().invoke(app, ["--out", str(tmp_path), "--quick"])
    assert done.exit_code == 0, done.output
    assert given == [ExperimentSettings(LocalizationConfig(), 0, quick=True)]
    assert (tmp_path / "seen-again.md").exists()
    assert CliRunner().invoke(app, ["--out", str(tmp_path), "--seed", "1"]).exit_code == 2


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
