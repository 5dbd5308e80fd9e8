"""Mapping and localization for small robots with a 2D LiDAR.

The names offered here, listed in ``__init__.pyi``, are loaded when first used: each costs seconds of imports
that a command which does not need it should not pay.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
