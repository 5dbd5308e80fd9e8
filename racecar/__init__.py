"""Mapping and localization for small robots with a 2D LiDAR.

The names offered here, listed in ``__init__.pyi``, are loaded when first used: each costs seconds of imports
that a command which does not need it should not pay.
"""

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """The names offered, and ``__version__``, that of the installed package."""
    if name != "__version__":
        return _load(name)
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("racecar-slam")
    except PackageNotFoundError:  # a checkout that was never installed
        return "unknown"
