"""The frames of a simulated car."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FrameNames:
    """All but the map's bear the car's namespace, so that several cars can be shown in one tree."""

    map: str
    odom: str
    base: str
    laser: str

    @classmethod
    def in_namespace(cls, namespace: str) -> "FrameNames":
        """Of a node's namespace such as ``/`` or ``/car1``."""
        prefix = f"{namespace}/".lstrip("/")
        return cls("map", f"{prefix}odom", f"{prefix}base_link", f"{prefix}laser")
