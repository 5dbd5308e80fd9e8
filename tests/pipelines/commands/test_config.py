"""``racecar config``: a file of all settings that changes nothing, and what is said of an edited one."""

import re
from pathlib import Path

import pytest

from racecar.maps.nested_settings import leaf_fields
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.config_file import Config, load_config


@pytest.fixture
def template(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    assert run(["config"]) == 0
    path = tmp_path / "settings.yaml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    return path


def freed(text: str, name: str = r"\w+") -> str:
    """With the # before a setting removed, or before all."""
    return re.sub(rf"^( *)# ({name}: .*)$", r"\1\2", text, flags=re.MULTILINE)


def test_it_changes_nothing_as_it_is(template: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert load_config(template) == Config()
    assert run(["config", "--check", str(template)]) == 0
    assert capsys.readouterr().out == f"{template} is valid and changes nothing.\n"


def test_every_line_freed_gives_the_defaults(template: Path) -> None:
    text = freed(template.read_text())
    assert text.count("\n") == template.read_text().count("\n")
    template.write_text(text)
    assert load_config(template) == Config()
    leaves = [name.rpartition(".")[2] for name, _ in leaf_fields(Config)]
    assert sorted(re.findall(r"^ +(\w+): \S", text, flags=re.MULTILINE)) == sorted(leaves)


def test_every_setting_is_explained(template: Path) -> None:
    lines = template.read_text().splitlines()
    settings = [number for number, line in enumerate(lines) if re.match(r" *# \w+: ", line)]
    assert len(settings) == len(list(leaf_fields(Config)))
    assert [lines[number] for number in settings if not lines[number - 1].strip().startswith("## ")] == []
    assert max(len(line) for number, line in enumerate(lines) if number not in settings) <= 110


def test_one_line_freed_and_edited(template: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = freed(template.read_text(), "drift_noise")
    text = re.sub(r"^( *drift_noise: ).*$", r"\g<1>3.1", text, flags=re.MULTILINE)
    template.write_text(text)
    assert load_config(template).localization.drift_noise == 3.1
    assert run(["config", "--check", str(template)]) == 0
    default = Config().localization.drift_noise
    said = f"changes localization.drift_noise from {default} to 3.1.\n"
    assert capsys.readouterr().out.endswith(said)


def test_changes_are_told_in_the_words_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "settings.yaml"
    path.write_text("sensors: {min_range: 0.3}\nmapping: {refine: false, rendering: {crop: driven}}\n")
    assert run(["config", "--check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "sensors.min_range from null to 0.3; mapping.refine from true to false" in said
    assert "mapping.rendering.crop from null to driven." in said


def test_a_mistake_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text("localization: {particels: 5}\n")
    assert run(["config", "--check", str(path)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "'localization.particels'; did you mean 'localization.particles'" in shown.err
    assert shown.err.count("\n") == 1
