"""One YAML file for the settings of every stage; what it leaves out keeps its default."""

from difflib import get_close_matches
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.pipelines.files.text_file import read_text


class Config(BaseModel):
    """The settings, one section per stage."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    mapping: MappingConfig = Field(default_factory=MappingConfig)
    localization: LocalizationConfig = Field(default_factory=LocalizationConfig)


def load_config(path: Path | None) -> Config:
    """The settings of a YAML file, or the defaults. Raises UserError that names the key at fault."""
    if path is None:
        return Config()
    try:
        return Config.model_validate(_read_yaml(path))
    except ValidationError as error:
        raise UserError(_explain(error, path)) from error


def _read_yaml(path: Path) -> Any:
    try:
        contents = yaml.safe_load(read_text(path))
    except yaml.MarkedYAMLError as error:
        line = f" at line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise UserError(f"The configuration {path} is not valid YAML{line}: {error.problem}.") from error
    except yaml.YAMLError as error:
        raise UserError(f"The configuration {path} is not a YAML text file.") from error
    contents = {} if contents is None else contents
    if not isinstance(contents, dict):
        raise UserError(f"The configuration {path} should hold sections such as 'mapping:' with settings.")
    return contents


def _explain(error: ValidationError, path: Path) -> str:
    first = error.errors()[0]
    location = [str(part) for part in first["loc"]]
    name = ".".join(location)
    if first["type"] == "extra_forbidden":
        return f"The configuration {path} has the unknown key '{name}'; {_suggest(location)}."
    return f"The configuration {path} has a bad value for '{name}': {_as_clause(first['msg'])}."


def _suggest(location: list[str]) -> str:
    known = _keys_at(location[:-1])
    nearest = get_close_matches(location[-1], known, n=1)
    if nearest:
        return f"did you mean '{'.'.join([*location[:-1], nearest[0]])}'"
    return f"known there: {', '.join(known)}"


def _keys_at(section: list[str]) -> list[str]:
    model: type[BaseModel] = Config
    for name in section:
        nested = model.model_fields[name].annotation if name in model.model_fields else None
        if not (isinstance(nested, type) and issubclass(nested, BaseModel)):
            return []
        model = nested
    return sorted(model.model_fields)


def _as_clause(message: str) -> str:
    return message[:1].lower() + message[1:]
