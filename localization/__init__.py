"""From a map, scans and odometry to the car's pose: Monte Carlo localization."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
