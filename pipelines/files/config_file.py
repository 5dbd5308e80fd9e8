"""A single YAML file with the settings of every stage; omitted settings keep their defaults."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from pydantic import Field

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.nested_settings import without_empty_sections
from racecar.maps.settings import Settings, SettingsError
from racecar.maps.text_files import read_text
from racecar.maps.yaml_text import MOST_BYTES, UnreadableYamlError, parse_yaml
from racecar.sensors.config import SensorConfig

Model = TypeVar("Model", bound=Settings)


class Config(Settings):
    """All settings: a section for the sensors, and one per stage."""

    sensors: SensorConfig = Field(default_factory=SensorConfig)
    mapping: MappingConfig = Field(default_factory=MappingConfig)
    localization: LocalizationConfig = Field(default_factory=LocalizationConfig)


ConfigSource: TypeAlias = Config | str | Path | Mapping[str, Any] | None
"""A YAML file, its contents, or settings; None means the defaults."""


def load_config(source: ConfigSource) -> Config:
    """Settings from a YAML file or its contents, or the defaults.

    Raises UserError that names the key at fault.
    """
    if source is None:
        return Config()
    if isinstance(source, Config):
        return source
    name = "The configuration" if isinstance(source, Mapping) else f"The configuration {source}"
    contents = source if isinstance(source, Mapping) else _read_yaml(Path(source))
    contents = without_empty_sections(contents, Config)
    config = _validated(contents, name, Config)
    _refuse_contradiction(contents, name)
    return config


def _refuse_contradiction(contents: Mapping[str, Any], name: str) -> None:
    """Reject two contradictory counts. One alone may contradict the other's default, and bounds it."""
    given = contents.get("localization", {})
    most, fewest = given.get("particles"), given.get("fewest_particles")
    if most is not None and fewest is not None and int(fewest) > int(most):
        raise UserError(
            f"{name} has more 'localization.fewest_particles' ({fewest}) than "
            f"'localization.particles' ({most}), which are the most; swap them."
        )


def load_settings(path: Path, model: type[Model]) -> Model:
    """Load settings of any kind from a YAML file. Raises UserError that names the key at fault."""
    return _validated(_read_yaml(path), f"The configuration {path}", model)


def _validated(contents: Mapping[str, Any], whole: str, model: type[Model]) -> Model:
    try:
        return model.model_validate(contents)
    except SettingsError as error:
        raise error.told_of(whole) from error


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        contents = parse_yaml(read_text(path, MOST_BYTES))
    except UnreadableYamlError as error:
        raise UserError(f"The configuration {path} cannot be used: {error}.") from error
    contents = {} if contents is None else contents
    if not isinstance(contents, dict):
        raise UserError(f"The configuration {path} should hold sections such as 'mapping:' with settings.")
    return contents
