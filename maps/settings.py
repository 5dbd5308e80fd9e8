"""The base class of all settings."""

import reprlib
from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator, model_validator

from racecar.maps.errors import UserError
from racecar.maps.nested_settings import nearest_name, section_at

_Settings = TypeVar("_Settings", bound="Settings")

_LONGEST_NAME = 100
"""Characters of a key in a message; no setting has a longer name."""
_IN_WORDS = {
    "a valid number": "a number",
    "a valid integer": "an integer",
    "a valid boolean": "true or false",
    "a valid string": "a text",
    "a valid tuple": "a list",
    "Keys should be strings": "the name of a setting",
}
"""For what pydantic says that a value should be."""


class SettingsError(UserError):
    """A setting that is unknown, or has a bad value. `told_of` words it for what the setting is part of."""

    def __init__(self, whole: str, name: str, clause: str, *, is_unknown: bool = False) -> None:
        """``whole`` begins the sentence, ``clause`` ends it: what the value should be, or which name."""
        super().__init__(whole, name, clause)
        self.name, self.clause, self.is_unknown = name, clause, is_unknown

    def __str__(self) -> str:
        return str(self.told_of(self.args[0]))

    def told_of(self, whole: str) -> UserError:
        """The sentence about a file or another ``whole`` that holds the setting."""
        if self.is_unknown:
            return UserError(f"{whole} has the unknown key '{self.name}'; {self.clause}.")
        where = f" has a bad value for '{self.name}'" if self.name else ""
        return UserError(f"{whole}{where}: {self.clause}.")


class Settings(BaseModel):
    """Typed fields with unit, meaning and the reason for each value.

    Nested settings may be given in part: the other fields keep their defaults. Raises SettingsError, a
    UserError that names the setting, when a key is misspelt or a value is bad.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, /, *unnamed: Any, **values: Any) -> None:
        name = type(self).__name__
        if unnamed:
            raise UserError(f"{name} takes settings by their names, such as {name}({self._example()}).")
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise _in_words(error, type(self)) from error

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # else nested ones raise by themselves

    @classmethod
    def model_validate(cls: type[_Settings], obj: Any, **options: Any) -> _Settings:
        """Settings from nested mappings. Raises SettingsError that names the setting at fault."""
        try:
            return super().model_validate(obj, **options)
        except ValidationError as error:
            raise _in_words(error, cls) from error

    def __setattr__(self, name: str, value: Any) -> None:
        kind = type(self).__name__
        raise UserError(
            f"{kind} does not change once it is made: make another, such as {kind}({name}={value!r})."
        )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        return {name: _over(defaults.get(name), value) for name, value in values.items()}

    @field_validator("*", mode="before")
    @classmethod
    def _is_of_its_kind(cls, value: Any, info: ValidationInfo) -> Any:
        """Reject truth values where numbers are expected; pydantic takes true for 1."""
        if isinstance(value, bool) and cls.model_fields[str(info.field_name)].annotation is not bool:
            raise ValueError("it should not be true or false")
        return value

    @classmethod
    def _example(cls) -> str:
        name, field = next(iter(cls.model_fields.items()))
        return f"{name}={field.get_default(call_default_factory=True)!r}"


def _over(default: Any, value: Any) -> Any:
    """Merge the values of a section into its defaults; other values stay as they are."""
    if not (isinstance(default, BaseModel) and isinstance(value, Mapping)):
        return value
    kept = {name: getattr(default, name) for name in type(default).model_fields if name not in value}
    return kept | {name: _over(getattr(default, name, None), one) for name, one in value.items()}


def _in_words(error: ValidationError, model: type[BaseModel]) -> SettingsError:
    """The first fault of those that pydantic found."""
    first, whole = error.errors()[0], model.__name__
    location = [str(part) for part in first["loc"]]
    name = _shortened(".".join(location))
    if first["type"] == "extra_forbidden":
        return SettingsError(whole, name, _suggest(location, model), is_unknown=True)
    section = section_at(model, location)
    if section is not None and first["type"] != "value_error":
        known = ", ".join(sorted(section.model_fields))
        return SettingsError(whole, name or whole, f"it should hold settings ({known})")
    return SettingsError(whole, name, _clause(first["type"], first["msg"], first["input"]))


def _suggest(location: list[str], model: type[BaseModel]) -> str:
    nearest = nearest_name(model, location)
    if nearest is not None:
        return f"did you mean '{nearest}'"
    section = section_at(model, location[:-1])
    known = ", ".join(sorted(section.model_fields) if section else ())
    return f"leave it out, or choose of those known there: {known}"


def _clause(kind: str, message: str, value: Any) -> str:
    """What a value should be; our own messages say it themselves, pydantic's without what the value is."""
    if kind == "value_error":
        words = message.removeprefix("Value error, ")
        return words[:1].lower() + words[1:]
    wanted = message.partition(", unable to ")[0].partition(", got ")[0].removeprefix("Input should be ")
    given = "" if value is None else f", not {_shortened(reprlib.repr(value))}"
    return f"it should be {_IN_WORDS.get(wanted, wanted)}{given}"


def _shortened(name: str) -> str:
    """Shorten a key or value, which may be anything, to one line."""
    words = " ".join(name.split())
    return words if len(words) <= _LONGEST_NAME else f"{words[:_LONGEST_NAME]}..."
