"""Build an occupancy map from scans and odometry: dead reckoning, scan matching, loop closure, pose graph."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
