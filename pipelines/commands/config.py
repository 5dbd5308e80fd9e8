"""``racecar config``: print all settings as a file to edit, or check a file of settings."""

from pathlib import Path
from typing import Annotated

import typer


def config(
    check: Annotated[
        Path | None,
        typer.Option(
            "--check", metavar="FILE", help="Name the mistake in a file of settings, or what it changes."
        ),
    ] = None,
) -> None:
    """Print every setting with its default, unit and reason: a file for --config, all commented out.

    Example: racecar config > settings.yaml

    After editing it: racecar config --check settings.yaml
    """
    from racecar.maps.nested_settings import leaf_values
    from racecar.pipelines.files.config_file import Config, load_config
    from racecar.pipelines.files.config_template import as_yaml, config_template

    if check is None:
        print(config_template(), end="")
        return
    defaults, values = leaf_values(Config()), leaf_values(load_config(check))
    changed = {name: value for name, value in values.items() if value != defaults[name]}
    if not changed:
        print(f"{check} is valid and changes nothing.")
        return
    changes = "; ".join(
        f"{name} from {as_yaml(defaults[name])} to {as_yaml(value)}" for name, value in changed.items()
    )
    print(f"{check} is valid and changes {changes}.")
