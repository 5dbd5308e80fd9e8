"""The way of one scan through the code, file by file: ``python -m tests.checks.one_scan`` prints it.

A reader who wants to know what becomes of a scan opens these files in this order.
"""

import ast
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median_low
from types import FrameType

import numpy as np

import racecar
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import drive, room

_ROOMS = Path(racecar.__file__).parent
_SECONDS = 8.0
"""Of the simulated drive: some thirty keyframes, before the first loop closure."""
Walk = tuple[str, ...]
"""Files, in the order in which a scan enters them."""


def walks() -> dict[str, Walk]:
    """The usual way of a scan between keyframes, of a keyframe, and of a scan on a known map."""
    mapper, localizer = Mapper(MappingConfig()), _localizer()
    found: dict[str, list[Walk]] = {"scan between keyframes": [], "keyframe": [], "scan on a known map": []}
    for message in drive(room(), _SECONDS, np.random.default_rng(0)).messages:
        if isinstance(message, Odometry):
            mapper.add_odometry(message)
            localizer.add_odometry(message)
            continue
        keyframes = mapper.growth.keyframes
        walk = _walk(mapper.add_scan, message)
        is_keyframe = mapper.growth.keyframes > keyframes
        found["keyframe" if is_keyframe else "scan between keyframes"].append(walk)
        found["scan on a known map"].append(_walk(localizer.add_scan, message))
    return {kind: _usual(each) for kind, each in found.items()}


def _localizer() -> Localizer:
    localizer = Localizer(room(), LocalizationConfig(), np.random.default_rng(0))
    localizer.scatter()
    return localizer


def _usual(walks: list[Walk]) -> Walk:
    """The last one of median length."""
    usual = median_low(len(walk) for walk in walks)
    return next(walk for walk in reversed(walks) if len(walk) == usual)


def _walk(add_scan: Callable[[Scan], object], scan: Scan) -> Walk:
    entered: dict[str, None] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        path = Path(frame.f_code.co_filename)
        if event == "call" and path.is_relative_to(_ROOMS):
            entered.setdefault(str(path.relative_to(_ROOMS)))

    sys.setprofile(note)
    try:
        add_scan(scan)
    finally:
        sys.setprofile(None)
    return tuple(entered)


def table() -> Iterator[str]:
    """The walks, with the first sentence that each file says of itself, as Markdown."""
    for kind, walk in walks().items():
        yield f"\nA {kind} enters {len(walk)} files:\n\n| file | what it is |\n|---|---|"
        for name in walk:
            doc = ast.get_docstring(ast.parse((_ROOMS / name).read_text())) or ""
            yield f"| `{name}` | {' '.join(doc.split(chr(10) * 2)[0].split())} |"


if __name__ == "__main__":
    print("\n".join(table()))
