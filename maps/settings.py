"""What the settings of every component have in common."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Settings(BaseModel):
    """Typed fields, each with its unit, meaning and the reason of its value; a misspelt key is an error.

    Of settings nested in these, single ones may be given: the others keep the values that they have here.
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
    """The values of a section over its defaults, if it is one."""
    if not (isinstance(default, BaseModel) and isinstance(value, Mapping)):
        return value
    kept = {name: getattr(default, name) for name in type(default).model_fields if name not in value}
    return kept | {name: _over(getattr(default, name, None), one) for name, one in value.items()}
