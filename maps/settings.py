"""The base class of all settings."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Settings(BaseModel):
    """Typed fields with unit, meaning and the reason for each value; a misspelt key is an error.

    Nested settings may be given in part: the other fields keep their defaults.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        return {name: _over(defaults.get(name), value) for name, value in values.items()}


def _over(default: Any, value: Any) -> Any:
    """Merge the values of a section into its defaults; other values stay as they are."""
    if not (isinstance(default, BaseModel) and isinstance(value, Mapping)):
        return value
    kept = {name: getattr(default, name) for name in type(default).model_fields if name not in value}
    return kept | {name: _over(getattr(default, name, None), one) for name, one in value.items()}
