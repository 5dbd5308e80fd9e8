import re
from pathlib import Path

import pytest

import racecar
from racecar.maps.errors import UserError
from racecar.maps.nested_settings import leaf_fields, leaf_values, nested
from racecar.pipelines.files.config_file import Config, load_config, load_settings
from tests.maps.nested_settings import Camera, Lens, Robot


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "config.yaml"
    path.write_text(text)
    return path


def test_defaults(tmp_path: Path) -> None:
    assert load_config(None) == Config()
    assert load_config(write(tmp_path, "# nothing yet\n")) == Config()


def test_a_file_overrides(tmp_path: Path) -> None:
    config = load_config(write(tmp_path, "localization:\n  particles: 123\n"))
    assert config.localization.particles == 123
    assert config.mapping == Config().mapping
    assert config.localization.beams == Config().localization.beams


LEAVES = [name for name, _ in leaf_fields(Config)]
VALUES = (True, False, 0.3, 0.9, 12, "driven", "corner", "raw", [[1.0, 2.0]])
"""Of every kind that a setting has; each takes one of them."""
MOST_LEAVES = 55
"""Which a user reads through before he gives up, by judgement."""


def changed_by(name: str) -> set[str]:
    """The settings that differ from the defaults where one is set to something else."""
    defaults = leaf_values(Config())
    for value in VALUES:
        try:
            values = leaf_values(load_config(nested({name: value})))
        except UserError:
            continue
        if values[name] != defaults[name]:
            return {each for each in defaults if values[each] != defaults[each]}
    raise AssertionError(f"no value for {name}")


@pytest.mark.parametrize("name", LEAVES)
def test_a_setting_changes_what_it_names_and_nothing_else(name: str) -> None:
    assert changed_by(name) == {name}


def test_every_setting_is_read_somewhere() -> None:
    rooms = [
        Path(racecar.__file__).parent / name for name in ("sensors", "mapping", "localization", "pipelines")
    ]
    files = [path for room in rooms for path in room.rglob("*.py") if path.name != "config.py"]
    read = set(re.findall(r"\.(\w+)", "\n".join(path.read_text() for path in files)))
    assert not {name for name in LEAVES if name.split(".")[-1] not in read}
    assert len(LEAVES) <= MOST_LEAVES


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("sensors: {min_height: 1.5}\n", r"'sensors': min_height \(1.5\) should be below max_height \(1\)"),
        ("sensors: {min_range: 3, max_range: 2}\n", "min_range .* should be below max_range"),
        ("localisation:\n  particles: 5\n", "'localisation'; did you mean 'localization'"),
        (
            "localization:\n  particels: 5\n",
            "'localization.particels'; did you mean 'localization.particles'",
        ),
        ("localization:\n  qqq: 5\n", "'localization.qqq'; leave it out, or .* known there: .*particles"),
        ("localization: {slip: .inf}\n", "'localization.slip': .*finite"),
        ("localization: {tracking: {news_after: 0.1}}\n", "'localization.tracking'; .* known there: beams, "),
        (
            "mapping: {loops: {candidates: {sigmas: 3}}}\n",
            "'mapping.loops'; leave it out, or .*: close_loops, ",
        ),
        (
            "mapping: {rendering: {settled_probability: 0.9}}\n",
            "'mapping.rendering.settled_probability'; leave it out, or .*: crop, ",
        ),
        ("mapping:\n  rendering: {left_out: [[2.0, 1.0]]}\n", "left_out': .*the earlier first"),
        ("localization:\n  particles: many\n", "bad value for 'localization.particles': .*integer"),
        ("localization: 5\n", "bad value for 'localization'"),
        ("localization: {drift_noise: 1.0e+300}\n", "'localization.drift_noise': .*less than or equal to 10"),
        ("localization: {particles: 10, fewest_particles: 1000}\n", "fewest_particles' .1000. than"),
        ("- a\n- b\n", "should hold sections"),
        ("mapping: [1, 2\nb: c\n", "line 2 is not valid YAML"),
        ("a: \x00\n", "not a YAML text file"),
        ("mapping: 2001-99-01\n", "line 1 holds a value that cannot be read .month must be in 1..12"),
        ("mapping: " + "[" * 5000, "nested more than 40 levels deep"),
        ("mapping: {}\nlocalization: {}\nmapping: {}\n", "line 3 gives the key 'mapping' a second time"),
        ("? " + "k" * 5000 + "\n: 1\n", "unknown key 'k{100}[.]{3}'"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, complaint: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(UserError, match=complaint) as caught:
        load_config(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="Cannot read"):
        load_config(tmp_path / "absent.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(UserError, match="not a text file"):
        load_config(tmp_path / "binary.yaml")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("camera: {lens: {fokus: 1}}\n", "'camera.lens.fokus'; did you mean 'camera.lens.focus'"),
        ("focus: 1\n", "'focus'; did you mean 'camera.lens.focus'"),
        ("camera: {zzz: 1}\n", "'camera.zzz'; .* known there: exposures, lens, mode"),
        ("camera: {lens: {focus: 9}}\n", "bad value for 'camera.lens.focus': .*less than or equal to 2"),
        ("camera: {lens: {rings: [1, x]}}\n", "bad value for 'camera.lens.rings.1': .*integer"),
        ("camera: {lens: 5}\n", r"bad value for 'camera.lens': it should hold settings \(focus, rings\)"),
        ("camera: {mode: dusk}\n", "bad value for 'camera.mode': .*'day' or 'night'"),
    ],
)
def test_mistakes_in_nested_settings_are_named(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(UserError, match=complaint):
        load_settings(write(tmp_path, text), Robot)


def test_nested_settings_are_overridden_one_by_one(tmp_path: Path) -> None:
    robot = load_settings(write(tmp_path, "camera: {lens: {focus: 1.5}}\n"), Robot)
    assert robot == Robot(camera=Camera(lens=Lens(focus=1.5)))
