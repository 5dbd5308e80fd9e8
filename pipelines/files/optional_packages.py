"""Packages missing from the light install, which is for the car's computer."""

from importlib.util import find_spec

from racecar.maps.errors import UserError

OPTIONAL = ("evo", "ezdxf", "libusb_package", "matplotlib", "open3d", "svgelements", "viser")
"""Import names of the packages in the extra ``full``."""


def is_installed(package: str) -> bool:
    """Whether an optional package can be imported."""
    return find_spec(package) is not None


def how_to_install(package: str) -> str:
    """A clause for users."""
    return f"{package} is not installed; `pip install '.[full]'` in the clone of racecar-slam installs it"


def require(package: str, purpose: str) -> None:
    """Raises UserError that names the purpose of the package, if it is not installed."""
    if not is_installed(package):
        raise UserError(f"{purpose} needs a package: {how_to_install(package)}.")


def left_out(what: str, package: str) -> str:
    """A warning that something was not made because a package is missing."""
    return f"{what}, because {how_to_install(package)}."
