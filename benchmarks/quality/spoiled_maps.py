"""What makes a map wrong, by name: faults of the input, and mechanisms of the mapper switched off.

A laser upside down, which mirrors the map, is not among them: nothing in the map speaks against it, and it is
for the calibration to find, which reads a recording before it is mapped.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from benchmarks.harness.replaced import (
    LOOPS_NOT_SEEN_THROUGH,
    LOOPS_NOT_SUPPORTED,
    Replacement,
)
from benchmarks.quality import input_faults as faults
from racecar.mapping import mapper
from racecar.mapping.keyframes import constraints, placement
from racecar.mapping.loops import candidate_search, submap_matching, submap_search
from racecar.mapping.state import mapper_state
from racecar.sensors.matching.correlative_search import Window
from racecar.sensors.measurement import Measurement


@dataclass(frozen=True, eq=False)
class Spoiling:
    """How a drive is made worse."""

    faults: tuple[Callable[[list[Measurement]], list[Measurement]], ...] = ()
    """One after the other."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Of `MappingConfig`."""
    replacements: tuple[Replacement, ...] = ()
    """Of what is no setting."""

    def of(self, messages: list[Measurement]) -> list[Measurement]:
        """The messages of a drive, with all faults."""
        for fault in self.faults:
            messages = fault(messages)
        return messages


_WIDE = Window(5.0, 0.6)
_NO_LOOPS = {"close_loops": False}
_FEW_KEYFRAMES = {"keyframe_distance": 1.5, "keyframe_angle": 0.6}
_ONE_TIE = (
    *((module, "LOOKBACK", (1,)) for module in (constraints, mapper, mapper_state)),
    (placement, "_PLACED_AGAINST", (1,)),
)
_UNVERIFIED = (LOOPS_NOT_SEEN_THROUGH, LOOPS_NOT_SUPPORTED)
_ANY_LOOP = (
    *_UNVERIFIED,
    (submap_search, "AMBIGUOUS_SHARE", 1.0),
    (submap_search, "_NEAR_SHARE", 1.0),
    (submap_search, "WITHOUT_DRIFT", _WIDE),
    (candidate_search, "WITHOUT_DRIFT", _WIDE),
    (candidate_search, "_MIN_DRIFT", 0.1),
    (submap_matching, "_MAX_RESIDUAL", 0.2),
)
_short, _slips = (
    partial(faults.short_sighted, metres=4.0),
    partial(faults.slipping_wheels, every=4, spread=0.7),
)
_one_per_1_s, _one_per_2_s = (partial(faults.sparse_scans, seconds=seconds) for seconds in (1.0, 2.0))


def _mount(x: float, y: float, yaw: float) -> Spoiling:
    return Spoiling((partial(faults.moved_mount, moved=np.array([x, y, yaw])),))


UNSPOILED = "as it is"
SPOILINGS: Mapping[str, Spoiling] = {
    UNSPOILED: Spoiling(),
    "no loops": Spoiling(settings=_NO_LOOPS),
    "unverified loops": Spoiling(replacements=_UNVERIFIED),
    "any loop": Spoiling(replacements=_ANY_LOOP),
    "any loop, one scan per 1 s": Spoiling((_one_per_1_s,), replacements=_ANY_LOOP),
    "one tie": Spoiling(settings=_NO_LOOPS, replacements=_ONE_TIE),
    "few keyframes": Spoiling(settings=_FEW_KEYFRAMES),
    "few keyframes, no loops": Spoiling(settings={**_FEW_KEYFRAMES, **_NO_LOOPS}),
    "no wheels": Spoiling((faults.without_wheels,)),
    "no wheels, no loops": Spoiling((faults.without_wheels,), _NO_LOOPS),
    "wheels 1.3 long": Spoiling((partial(faults.scaled_wheels, forward=1.3),)),
    "wheels 0.5 long": Spoiling((partial(faults.scaled_wheels, forward=0.5),)),
    "wheels backwards": Spoiling((partial(faults.scaled_wheels, forward=-1.0),)),
    "wheels stand": Spoiling((partial(faults.scaled_wheels, forward=0.0, turn=0.0),)),
    "wheels turn 1.3": Spoiling((partial(faults.scaled_wheels, turn=1.3),)),
    "wheels turn 0.3": Spoiling((partial(faults.scaled_wheels, turn=0.3),)),
    "wheels turn the other way": Spoiling((partial(faults.scaled_wheels, turn=-1.0),)),
    "wheels pull aside": Spoiling((partial(faults.scaled_wheels, bias=0.1),)),
    "wheels pull aside, no loops": Spoiling((partial(faults.scaled_wheels, bias=0.03),), _NO_LOOPS),
    "wheels slip": Spoiling((_slips,)),
    "wheels slip, one scan per 1 s": Spoiling((_slips, _one_per_1_s)),
    "wheels slip, short": Spoiling((_slips, _short)),
    "wheels late": Spoiling((partial(faults.late_wheels, seconds=0.3),)),
    "wheels early": Spoiling((partial(faults.late_wheels, seconds=-0.5),)),
    "mount turned 10°": _mount(0.0, 0.0, 0.17),
    "mount turned 30°": _mount(0.0, 0.0, 0.52),
    "mount turned round": _mount(0.0, 0.0, np.pi),
    "mount off": _mount(0.5, 0.2, 0.0),
    "sweep reversed": Spoiling((faults.reversed_sweep,)),
    "bearings 0.5": Spoiling((partial(faults.scaled_bearings, factor=0.5),)),
    "bearings 1.06": Spoiling((partial(faults.scaled_bearings, factor=1.06),)),
    "one scan per 1 s": Spoiling((_one_per_1_s,)),
    "one scan per 2 s": Spoiling((_one_per_2_s,)),
    "one scan per 2 s, no wheels": Spoiling((_one_per_2_s, faults.without_wheels)),
    "gaps": Spoiling((partial(faults.scan_gaps, seconds=5.0, every=20.0),)),
    "blackout": Spoiling((partial(faults.blackout, seconds=12.0),)),
    "short": Spoiling((_short,)),
    "short, no loops": Spoiling((_short,), _NO_LOOPS),
    "short, no wheels": Spoiling((_short, faults.without_wheels)),
    "noise 5 cm": Spoiling((partial(faults.noisy, metres=0.05),)),
    "narrow": Spoiling((partial(faults.narrow, degrees=90.0),)),
    "narrow, no wheels": Spoiling((partial(faults.narrow, degrees=60.0), faults.without_wheels)),
    "few beams": Spoiling((partial(faults.fewer_beams, every=12),)),
    "most beams empty": Spoiling((partial(faults.dropping_out, share=0.8),)),
    "posts": Spoiling((faults.with_posts,)),
    "floor": Spoiling((partial(faults.sees_floor, metres=3.0),)),
}
