"""Dotted names of settings in settings."""

import pytest

from racecar.maps.nested_settings import leaf_fields, leaf_values, nearest_name, nested, section_at
from tests.maps.nested_settings import Camera, Lens, Robot


def test_every_setting_has_a_dotted_name_and_comes_back_by_it() -> None:
    robot = Robot(speed=2.0, camera=Camera(lens=Lens(focus=0.25)))
    values = leaf_values(robot)
    assert values["camera.lens.focus"] == 0.25
    assert values["speed"] == 2.0
    assert list(values) == [name for name, _ in leaf_fields(Robot)]
    assert nested({"a": 1, "b.c": 2, "b.d.e": 3}) == {"a": 1, "b": {"c": 2, "d": {"e": 3}}}
    assert Robot.model_validate(nested(values)) == robot


def test_sections_are_found_by_their_path() -> None:
    assert section_at(Robot, []) is Robot
    assert section_at(Robot, ["camera", "lens"]) is Lens
    assert section_at(Robot, ["camera", "mode"]) is None
    assert section_at(Robot, ["elsewhere"]) is None


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("sped", "speed"),
        ("camera.lense", "camera.lens"),
        ("camera.lens.fokus", "camera.lens.focus"),
        ("focus", "camera.lens.focus"),
        ("camera.speed", "speed"),
        ("camera.zzz", None),
        ("nowhere.at.all", None),
    ],
)
def test_the_nearest_name_is_sought_in_its_section_and_then_elsewhere(wrong: str, meant: str | None) -> None:
    assert nearest_name(Robot, wrong.split(".")) == meant
