"""Settings nested in settings, each by its dotted name such as ``mapping.rendering.crop``."""

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_MUCH_ALIKE = 0.8
"""Difflib's ratio of two names from which one may be the other misspelt, by judgement: one letter in five.
With less, a setting that is gone is taken for one of another meaning."""


def leaf_fields(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """The fields that hold a value rather than further settings, by their dotted names."""
    for name, field in model.model_fields.items():
        inner = model_in(field)
        if inner is None:
            yield prefix + name, field
        else:
            yield from leaf_fields(inner, f"{prefix}{name}.")


def leaf_values(settings: BaseModel) -> dict[str, Any]:
    """The values of the `leaf_fields`, by dotted name."""
    return {name: _value(settings, name.split(".")) for name, _ in leaf_fields(type(settings))}


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by dotted name as the nested dictionaries from which settings are made."""
    contents: dict[str, Any] = {}
    for name, value in values.items():
        *sections, last = name.split(".")
        place = contents
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = value
    return contents


def without_empty_sections(contents: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """Nested dictionaries without the sections that hold nothing, as when all their lines are comments."""
    kept = {}
    for name, value in contents.items():
        inner = section_at(model, [name])
        if inner is None:
            kept[name] = value
        elif value is not None:
            kept[name] = without_empty_sections(value, inner) if isinstance(value, Mapping) else value
    return kept


def section_at(model: type[BaseModel], path: Sequence[str]) -> type[BaseModel] | None:
    """The settings nested at a path of names; None where there are none."""
    for name in path:
        inner = model_in(model.model_fields[name]) if name in model.model_fields else None
        if inner is None:
            return None
        model = inner
    return model


def nearest_name(model: type[BaseModel], path: Sequence[str]) -> str | None:
    """The dotted name that was probably meant by a misspelt path: one much like it in the same section, or
    the same one in another section; None where nothing is near."""
    *sections, wrong = path
    section = section_at(model, sections)
    near = get_close_matches(wrong, section.model_fields if section else (), n=1, cutoff=_MUCH_ALIKE)
    if near:
        return ".".join([*sections, near[0]])
    return next((name for name, _ in leaf_fields(model) if name.split(".")[-1] == wrong), None)


def model_in(field: FieldInfo) -> type[BaseModel] | None:
    """The kind of settings that a field holds, if it does."""
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _value(settings: Any, path: Sequence[str]) -> Any:
    for name in path:
        settings = getattr(settings, name)
    return settings
