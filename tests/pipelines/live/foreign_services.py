"""Service types of packages that are not installed here, as far as the nodes use them."""

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


def service(**response: Any) -> Any:
    """A type whose response begins with these values."""
    return SimpleNamespace(Response=lambda: SimpleNamespace(**response))


def install(patch: pytest.MonkeyPatch, package: str, **services: Any) -> None:
    """Let the nodes find a package with these services while the patch lasts."""
    from racecar.pipelines.live.ros import message_types

    module = ModuleType(f"{package}.srv")
    vars(module).update(services)
    patch.setitem(sys.modules, package, ModuleType(package))
    patch.setitem(sys.modules, f"{package}.srv", module)
    installed = message_types.get_resource
    patch.setattr(
        message_types,
        "get_resource",
        lambda kind, name: ("", "") if name == package else installed(kind, name),
    )
