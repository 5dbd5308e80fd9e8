"""The map as a point cloud, for programs that display or process point clouds."""

import ctypes
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.whole_files import write_atomically


def save_point_map(points: NDArray[np.float32], spacing: float, path: Path) -> None:
    """Write points (N, 2), in metres, as a PLY in the plane z = 0, one point per cube of edge ``spacing``.

    Raises UserError when the file cannot be written.
    """
    open3d = _import_open3d()
    in_space = np.column_stack([points, np.zeros(len(points))])
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(in_space)).voxel_down_sample(spacing)
    with write_atomically(path) as partial:
        if not open3d.io.write_point_cloud(str(partial), cloud):
            raise OSError(f"open3d could not write {partial}")


def require_open3d() -> None:
    """Raises UserError when open3d is not installed."""
    if find_spec("open3d") is None:
        raise UserError("--ply needs open3d, which is not installed; install it with: pip install open3d.")


def _import_open3d() -> ModuleType:
    """Imported only here, because it is large, slow to load and needed nowhere else."""
    import libusb_package

    # It links against libusb, which a bare machine lacks; open3d finds it once it is loaded.
    ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    import open3d

    module: ModuleType = open3d
    return module
