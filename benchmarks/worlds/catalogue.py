"""The worlds, by name: a map, and what is wrong with the car or its surroundings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class World:
    """Settings of `SimulationConfig` but for the seed."""

    map: str
    settings: Mapping[str, Any] = field(default_factory=dict)


_INDOORS = {"duration": 150.0, "scan_every": 0.1}
"""Some 270 m through the building's corridors and several rooms, with loops; of the race car's scans ten a
second are kept, as most robots have no more and the mapper needs no more."""
_SLOWLY = {"max_speed": 1.0}
"""m/s, as robots go whose loggers are slow: 1 to 3 m from scan to scan."""

WORLDS: Mapping[str, World] = {
    "plain": World("building", _INDOORS),
    "tilted": World("building", {**_INDOORS, "tilt": 2.0, "hills": 0.02}),
    "tilted short": World("building", {"laser": "short", "tilt": 4.0, "hills": 0.02}),
    "campus": World("campus", {"laser": "outdoor"}),
    "slope": World("campus", {"laser": "outdoor", "tilt": 0.5, "hills": 0.03, "kerbs": 0.15}),
    "posts": World("building", {**_INDOORS, "posts": 4}),
    "carried": World("building", {**_INDOORS, "carried": 10.0}),
    "carrier": World("building", {**_INDOORS, "carried": 10.0, "carrier": True}),
    "follower": World("building", {"laser": "round", "follower": True}),
    "one per 1 s": World("building", {**_SLOWLY, "scan_every": 1.0}),
    "one per 2 s": World("building", {**_SLOWLY, "scan_every": 2.0}),
    "one per 3 s": World("building", {**_SLOWLY, "scan_every": 3.0}),
    "gaps": World("building", {**_INDOORS, **_SLOWLY, "duration": 270.0, "scan_gaps": 3.0}),
    "short": World("building", {"laser": "short"}),
    "steering": World("building", {**_INDOORS, "steering": True}),
    "slow steering": World("building", {**_SLOWLY, "scan_every": 1.0, "steering": True}),
}
