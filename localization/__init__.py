"""Monte Carlo localization: from a map, scans and odometry to the car's pose."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
