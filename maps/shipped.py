"""The maps that come with the project."""

from pathlib import Path

_FOLDER = Path(__file__).parent / "shipped"


def shipped_names() -> list[str]:
    """The names that stand for a map wherever a map file is asked for."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def shipped_map(name: str) -> Path:
    """The YAML file of a shipped map; KeyError for a name that is none."""
    if name not in shipped_names():
        raise KeyError(name)
    return _FOLDER / f"{name}.yaml"
