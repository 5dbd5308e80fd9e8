"""Nested settings, addressed by dotted names such as ``mapping.rendering.crop``."""

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_MUCH_ALIKE = 0.8
"""Difflib's ratio of two names from which one may be a misspelling of the other. Chosen by judgement: one
letter in five. Below it, a removed setting is mistaken for one with another meaning."""


def leaf_fields(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Fields with a value instead of further settings, by dotted name."""
    for name, field in model.model_fields.items():
        inner = model_in(field)
        if inner is None:
            yield prefix + name, field
        else:
            yield from leaf_fields(inner, f"{prefix}{name}.")


def leaf_values(settings: BaseModel) -> dict[str, Any]:
    """Values of the `leaf_fields`, by dotted name."""
    return {name: _value(settings, name.split(".")) for name, _ in leaf_fields(type(settings))}


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Convert values by dotted name to nested dictionaries, from which settings are made."""
    contents: dict[str, Any] = {}
    for name, value in values.items():
        *sections, last = name.split(".")
        place = contents
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = value
    return contents


def without_empty_sections(contents: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """Nested dictionaries without empty sections, such as those with all their lines commented out."""
    kept = {}
    for name, value in contents.items():
        inner = section_at(model, [name])
        if inner is None:
            kept[name] = value
        elif value is not None:
            kept[name] = without_empty_sections(value, inner) if isinstance(value, Mapping) else value
    return kept


def section_at(model: type[BaseModel], path: Sequence[str]) -> type[BaseModel] | None:
    """The settings nested at a path of names; None if there are none."""
    for name in path:
        inner = model_in(model.model_fields[name]) if name in model.model_fields else None
        if inner is None:
            return None
        model = inner
    return model


def nearest_name(model: type[BaseModel], path: Sequence[str]) -> str | None:
    """The dotted name that a misspelt path probably means: a similar one in the same section, or the same one
    in another section; None if there is neither."""
    *sections, wrong = path
    section = section_at(model, sections)
    near = get_close_matches(wrong, section.model_fields if section else (), n=1, cutoff=_MUCH_ALIKE)
    if near:
        return ".".join([*sections, near[0]])
    return next((name for name, _ in leaf_fields(model) if name.split(".")[-1] == wrong), None)


def model_in(field: FieldInfo) -> type[BaseModel] | None:
    """The settings class of a field, if it has one."""
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _value(settings: Any, path: Sequence[str]) -> Any:
    for name in path:
        settings = getattr(settings, name)
    return settings
