"""All settings as a YAML file of comments, which has no effect until the # before a setting is removed."""

from collections.abc import Iterator
from enum import Enum
from textwrap import wrap
from typing import Any

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from racecar.maps.nested_settings import model_in
from racecar.pipelines.files.config_file import Config

_WIDTH = 110
"""Characters per line, as in the source."""
_LONG = 1e7
"""Numbers from this are written with a power of ten, because their zeros are hard to count."""
_NO_BREAK = "\u00a0"
_BOUNDS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}
_HEADING = (
    "Settings of racecar. Each is shown with its default: remove the # before a setting to change it,",
    "and pass this file as --config FILE. What is left out keeps its default.",
)


def config_template() -> str:
    """The text of the file."""
    lines = [*(f"# {line}" for line in _HEADING), *_section(Config(), 0)]
    return "\n".join(lines) + "\n"


def bounds_in_words(field: FieldInfo) -> str:
    """Bounds such as "> 0, ≤ 100"; empty if any value is allowed."""
    bounds = ((sign, getattr(each, kind, None)) for each in field.metadata for kind, sign in _BOUNDS.items())
    return ", ".join(f"{sign} {_as_number(bound)}" for sign, bound in bounds if bound is not None)


def _as_number(bound: float) -> str:
    """Format a number; integers below `_LONG` have no power of ten."""
    return f"{bound:.0f}" if bound == int(bound) and abs(bound) < _LONG else f"{bound:g}"


def _section(settings: BaseModel, depth: int) -> Iterator[str]:
    """Plain settings come first; after a nested section they would seem to belong to it."""
    indent = "  " * depth
    fields = sorted(type(settings).model_fields.items(), key=lambda item: model_in(item[1]) is not None)
    for name, field in fields:
        inner = model_in(field)
        if inner is None:
            yield from _comment(_explanation(field), indent)
            yield f"{indent}# {name}: {as_yaml(getattr(settings, name))}"
        else:
            yield ""
            yield from _comment(" ".join((inner.__doc__ or "").split()), indent)
            yield f"{indent}{name}:"
            yield from _section(getattr(settings, name), depth + 1)


def _explanation(field: FieldInfo) -> str:
    bounds = bounds_in_words(field).replace(" ", _NO_BREAK)
    return f"{field.description or ''} ({bounds})" if bounds else field.description or ""


def _comment(text: str, indent: str) -> Iterator[str]:
    for line in wrap(text, _WIDTH - len(indent) - 3, break_long_words=False, break_on_hyphens=False):
        yield f"{indent}## {line.replace(_NO_BREAK, ' ')}"


def as_yaml(value: Any) -> str:
    """A value as the file writes it, such as null."""
    text: str = yaml.safe_dump(_plain(value), default_flow_style=True, width=float("inf"))
    return text.removesuffix("...\n").strip()


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return value
