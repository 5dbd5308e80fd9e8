"""Packages that the light install, for the car's computer, does without."""

from importlib.util import find_spec

from racecar.maps.errors import UserError

OPTIONAL = ("evo", "ezdxf", "libusb_package", "matplotlib", "open3d", "viser")
"""By the names they are imported by; those of the extra ``full``."""


def is_installed(package: str) -> bool:
    """Whether an optional package can be imported."""
    return find_spec(package) is not None


def how_to_install(package: str) -> str:
    """A clause for people."""
    return f"{package} is not installed; `pip install 'racecar-slam[full]'` installs it"


def require(package: str, purpose: str) -> None:
    """Raises UserError that names the purpose of a package that is not installed."""
    if not is_installed(package):
        raise UserError(f"{purpose} needs a package: {how_to_install(package)}.")


def left_out(what: str, package: str) -> str:
    """A warning that something was not made for want of a package."""
    return f"{what}, because {how_to_install(package)}."
