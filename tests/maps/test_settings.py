import pytest
from pydantic import Field, ValidationError

from racecar.maps.settings import Settings


class Width(Settings):
    near: float = Field(0.1, gt=0)
    far: float = 0.2


class Pair(Settings):
    first: Width = Width(far=0.5)
    second: Width = Width()


class Whole(Settings):
    pair: Pair = Pair(second=Width(near=0.7))
    scale: float = 1.0


def test_single_nested_settings_leave_the_others_as_they_are_there() -> None:
    assert Whole.model_validate({"pair": {"first": {"near": 0.3}}}) == Whole(
        pair=Pair(first=Width(near=0.3, far=0.5), second=Width(near=0.7))
    )
    assert Whole.model_validate({"scale": 2.0}).pair == Whole().pair
    assert Whole(pair=Pair()).pair.second.near == 0.1


def test_a_misspelt_nested_key_and_a_bad_value_are_named_with_their_place() -> None:
    with pytest.raises(ValidationError) as error:
        Whole.model_validate({"pair": {"first": {"nera": 0.3}, "second": {"near": -1.0}}})
    assert [each["loc"] for each in error.value.errors()] == [
        ("pair", "first", "nera"),
        ("pair", "second", "near"),
    ]


def test_what_is_no_section_is_an_error() -> None:
    with pytest.raises(ValidationError):
        Whole.model_validate({"pair": 3})
    with pytest.raises(ValidationError):
        Whole.model_validate([1])
