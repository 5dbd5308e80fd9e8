"""The map as a point cloud, for programs that display or process point clouds."""

import ctypes
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from racecar.maps.whole_files import write_atomically

_COLORS_END_AT = (0.01, 0.99)
"""Quantiles of the heights at both ends of the colours, so that stray points do not make the rest look
alike."""


def save_point_map(clouds: Iterable[NDArray[np.float64]], spacing: float, path: Path) -> None:
    """Write points (N, 3) of each cloud, in metres, as a PLY, one point per cube of edge ``spacing``; if they
    are not all of one height, coloured by height.

    Raises UserError when the file cannot be written.
    """
    open3d = _import_open3d()
    whole = open3d.geometry.PointCloud()
    for points in clouds:  # thinned one by one: together they may not fit into memory
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        whole += cloud.voxel_down_sample(spacing)
    whole = whole.voxel_down_sample(spacing)
    heights = np.asarray(whole.points)[:, 2]
    if len(heights) and np.ptp(heights) > 0.0:
        whole.colors = open3d.utility.Vector3dVector(_colors(heights))
    with write_atomically(path) as partial:
        if not open3d.io.write_point_cloud(str(partial), whole):
            raise OSError(f"open3d could not write {partial}")


def _colors(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) red, green and blue of heights (N,)."""
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    low, high = np.quantile(heights, _COLORS_END_AT)
    rgba: NDArray[np.float64] = colormaps["turbo"](Normalize(low, high, clip=True)(heights))
    return rgba[:, :3]


def _import_open3d() -> ModuleType:
    """Imported only here, because it is large, slow to load and needed nowhere else."""
    import libusb_package

    # It links against libusb, which a bare machine lacks; open3d finds it once it is loaded.
    ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    import open3d

    module: ModuleType = open3d
    return module
