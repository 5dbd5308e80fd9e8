"""The maps that ship with the project."""

from pathlib import Path

_FOLDER = Path(__file__).parent / "shipped"


def shipped_names() -> list[str]:
    """Names that are accepted wherever a map file is."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def shipped_map(name: str) -> Path:
    """The YAML file of a shipped map. Raises KeyError for an unknown name."""
    if name not in shipped_names():
        raise KeyError(name)
    return _FOLDER / f"{name}.yaml"
