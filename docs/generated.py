"""What the pages of the reference take from the code when they are built, so that it is never out of date.

mkdocs calls `on_page_markdown` with each page; lines such as ``<!-- generated: commands -->`` become tables.
"""

import re
from collections.abc import Callable, Iterator
from typing import Any

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.pipelines.commands.cli import app
from racecar.pipelines.files.config_template import bounds_in_words
from racecar.sensors.config import SensorConfig
from tests.checks import one_scan

_MARKER = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: object) -> str:
    """A page with its markers replaced."""
    return _MARKER.sub(lambda found: "\n".join(_WRITERS[found[1]]()), markdown)


def _commands() -> Iterator[str]:
    """An index, and a short section for each command, whose flags are folded."""
    commands = dict(_each_command(typer.main.get_command(app), "racecar"))
    yield "| command | what it does |\n|---|---|"
    for name, command in commands.items():
        yield f"| [`{name}`](#{name.replace(' ', '-')}) | {_cell(_first_paragraph(command.help))} |"
    for name, command in commands.items():
        yield f"\n### {name}\n\n{_in_code(command.help)}\n"
        rows = [
            f"| {', '.join(f'`{each}`' for each in _names(parameter))} | {_cell(parameter.help or '')} "
            f"| {_default(parameter)} |"
            for parameter in command.params
        ]
        yield from _folded("Arguments and flags", "| argument or flag | what it does | default |", rows)


def _each_command(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    """A command and its name, or those below it; a group's own flags are none."""
    below = getattr(command, "commands", {})
    if not below:
        yield name, command
    for each, child in below.items():
        yield from _each_command(child, f"{name} {each}")


def _first_paragraph(text: str) -> str:
    return text.partition("\n\n")[0]


def _folded(title: str, heading: str, rows: list[str]) -> Iterator[str]:
    """A table that unfolds with a click on its title."""
    if rows:
        yield f'??? note "{title}"\n'
        yield from (f"    {row}" for row in (heading, re.sub(r"[^|]+", "---", heading), *rows))
        yield ""


def _names(parameter: Any) -> list[str]:
    if parameter.param_type_name == "argument":
        return [parameter.metavar or parameter.name.upper()]
    value = "" if parameter.is_flag else f" {parameter.metavar or parameter.name.upper()}"
    return [f"{option}{value}" for option in [*parameter.opts, *parameter.secondary_opts]]


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    value = getattr(parameter.default, "value", parameter.default)
    is_none = value is None or isinstance(value, bool | tuple) or callable(value)
    return "" if is_none else f"`{value}`"


def _in_code(text: str) -> str:
    """Examples stand out."""
    return re.sub(r"(racecar [a-z].*|ros2 launch .*)$", r"`\1`", text, flags=re.MULTILINE)


def _settings(config: type[BaseModel]) -> Iterator[str]:
    yield from _section(config, "")


def _section(config: type[BaseModel], prefix: str) -> Iterator[str]:
    plain = {name: field for name, field in config.model_fields.items() if not _is_section(field)}
    if prefix:
        yield f"\n### {prefix}\n\n{_cell(config.__doc__ or '')}\n"
    title = f"{len(plain)} settings" if len(plain) > 1 else "One setting"
    rows = [_setting(name, field) for name, field in plain.items()]
    yield from _folded(f"{title}: {', '.join(plain)}", "| setting | default | range | meaning |", rows)
    for name, field in config.model_fields.items():
        if _is_section(field):
            yield from _section(field.annotation, f"{prefix}.{name}" if prefix else name)


def _setting(name: str, field: FieldInfo) -> str:
    bounds = bounds_in_words(field).replace("≥ ", "≥&nbsp;").replace("≤ ", "≤&nbsp;")
    bounds = bounds.replace("> ", ">&nbsp;").replace("< ", "<&nbsp;")
    return f"| `{name}` | {_value(field.default)} | {bounds} | {_cell(field.description or '')} |"


def _is_section(field: FieldInfo) -> bool:
    return isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, float):
        return f"`{value:.6g}`"
    text = "null" if value is None else str(getattr(value, "value", value))
    return f"`{text}`" if len(text) < 60 else "see the source"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


_WRITERS: dict[str, Callable[[], Iterator[str]]] = {
    "commands": _commands,
    "sensors": lambda: _settings(SensorConfig),
    "mapping": lambda: _settings(MappingConfig),
    "localization": lambda: _settings(LocalizationConfig),
    "one_scan": one_scan.table,
}
