"""From scans and odometry to an occupancy map: odometry, constraints, loop closure, pose graph."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
