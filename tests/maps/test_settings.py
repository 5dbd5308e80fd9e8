import pickle

import pytest
from pydantic import Field, model_validator

from racecar.maps.errors import UserError
from racecar.maps.settings import Settings, SettingsError


class Width(Settings):
    near: float = Field(0.1, gt=0)
    far: float = 0.2


class Pair(Settings):
    first: Width = Width(far=0.5)
    second: Width = Width()


class Whole(Settings):
    pair: Pair = Pair(second=Width(near=0.7))
    scale: float = 1.0
    is_on: bool = True


def test_single_nested_settings_leave_the_others_as_they_are_there() -> None:
    assert Whole.model_validate({"pair": {"first": {"near": 0.3}}}) == Whole(
        pair=Pair(first=Width(near=0.3, far=0.5), second=Width(near=0.7))
    )
    assert Whole.model_validate({"scale": 2.0}).pair == Whole().pair
    assert Whole(pair=Pair()).pair.second.near == 0.1


MISTAKES: list[tuple[dict[str, object], str]] = [
    ({"pair": {"first": {"farr": 0.3}}}, "unknown key 'pair.first.farr'; did you mean 'pair.first.far'."),
    ({"pair": {"second": {"near": -1}}}, "'pair.second.near': it should be greater than 0, not -1."),
    ({"pair": 3}, "'pair': it should hold settings (first, second)."),
    ({"scale": "big"}, "'scale': it should be a number, not 'big'."),
    ({"scale": None}, "'scale': it should be a number."),
    ({"scale": True}, "'scale': it should not be true or false."),
    ({"is_on": 2}, "'is_on': it should be true or false, not 2."),
    ({"scale": "x\n" * 500}, "'scale': it should be a number, not 'x"),
]


@pytest.mark.parametrize(("values", "words"), MISTAKES)
def test_a_mistake_is_one_sentence_that_names_its_place(values: dict[str, object], words: str) -> None:
    for make in (lambda: Whole(**values), lambda: Whole.model_validate(values)):  # type: ignore[arg-type]
        with pytest.raises(SettingsError) as caught:
            make()
        assert str(caught.value).startswith("Whole has ")
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)
        assert "pydantic" not in str(caught.value)


def test_the_sentence_names_what_holds_the_setting_and_survives_another_process() -> None:
    with pytest.raises(SettingsError) as caught:
        Whole(sacle=2.0)  # type: ignore[call-arg]
    assert (
        str(caught.value.told_of("The file")) == "The file has the unknown key 'sacle'; did you mean 'scale'."
    )
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_what_contradicts_itself_is_told_of_the_whole() -> None:
    class Ordered(Settings):
        low: float = 1.0
        high: float = 2.0

        @model_validator(mode="after")
        def _in_order(self) -> "Ordered":
            if self.low >= self.high:
                raise ValueError("low should be below high")
            return self

    with pytest.raises(UserError, match=r"^Ordered: low should be below high\.$"):
        Ordered(low=3.0)


def test_settings_are_named_and_stay() -> None:
    with pytest.raises(UserError, match=r"takes settings by their names, such as Width\(near=0.1\)"):
        Width(0.3)  # type: ignore[misc]
    with pytest.raises(UserError, match=r"make another, such as Width\(near=0.3\)"):
        Width().near = 0.3  # type: ignore[misc]
    with pytest.raises(UserError):
        Whole.model_validate([1])
