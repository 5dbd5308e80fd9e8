"""Ways to spoil a map, by name: input faults, and mechanisms of the mapper switched off.

A laser mounted upside down, which mirrors the map, is not among them. Nothing in the map contradicts it; the
calibration, which reads a recording before it is mapped, has to find it.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from benchmarks.harness import input_faults as faults
from benchmarks.harness.variant import LOOPS_NOT_SEEN_THROUGH, LOOPS_NOT_SUPPORTED, Variant, replacing
from racecar.mapping import mapper
from racecar.mapping.keyframes import constraints, placement
from racecar.mapping.loops import candidate_search, submap_matching, submap_search
from racecar.mapping.state import mapper_state
from racecar.sensors.matching.correlative_search import Window
from racecar.sensors.measurement import Measurement

_WIDE = Window(5.0, 0.6)
_NO_LOOPS = Variant({"close_loops": False})
_FEW_KEYFRAMES = Variant({"keyframe_distance": 1.5, "keyframe_angle": 0.6})
_ONE_TIE = (
    replacing(constraints, LOOKBACK=(1,))
    | replacing(mapper, LOOKBACK=(1,))
    | replacing(mapper_state, LOOKBACK=(1,))
    | replacing(placement, _PLACED_AGAINST=(1,))
)
_UNVERIFIED = LOOPS_NOT_SEEN_THROUGH | LOOPS_NOT_SUPPORTED
_ANY_LOOP = (
    _UNVERIFIED
    | replacing(submap_search, AMBIGUOUS_SHARE=1.0, _NEAR_SHARE=1.0, WITHOUT_DRIFT=_WIDE)
    | replacing(candidate_search, WITHOUT_DRIFT=_WIDE, _MIN_DRIFT=0.1)
    | replacing(submap_matching, _MAX_RESIDUAL=0.2)
)


def _fault(fault: Callable[..., list[Measurement]], **how: Any) -> Variant:
    return Variant(faults=(partial(fault, **how),))


def _mount(x: float, y: float, yaw: float) -> Variant:
    return _fault(faults.moved_mount, moved=np.array([x, y, yaw]))


_SHORT = _fault(faults.short_sighted, metres=4.0)
_SLIPS = _fault(faults.slipping_wheels, every=4, spread=0.7)
_NO_WHEELS = _fault(faults.without_wheels)
_ONE_PER_1_S, _ONE_PER_2_S = (_fault(faults.sparse_scans, seconds=seconds) for seconds in (1.0, 2.0))

UNSPOILED = "as it is"
SPOILINGS: Mapping[str, Variant] = {
    UNSPOILED: Variant(),
    "no loops": _NO_LOOPS,
    "unverified loops": _UNVERIFIED,
    "any loop": _ANY_LOOP,
    "any loop, one scan per 1 s": _ONE_PER_1_S | _ANY_LOOP,
    "one tie": _NO_LOOPS | _ONE_TIE,
    "few keyframes": _FEW_KEYFRAMES,
    "few keyframes, no loops": _FEW_KEYFRAMES | _NO_LOOPS,
    "no wheels": _NO_WHEELS,
    "no wheels, no loops": _NO_WHEELS | _NO_LOOPS,
    "wheels 1.3 long": _fault(faults.scaled_wheels, forward=1.3),
    "wheels 0.5 long": _fault(faults.scaled_wheels, forward=0.5),
    "wheels backwards": _fault(faults.scaled_wheels, forward=-1.0),
    "wheels stand": _fault(faults.scaled_wheels, forward=0.0, turn=0.0),
    "wheels turn 1.3": _fault(faults.scaled_wheels, turn=1.3),
    "wheels turn 0.3": _fault(faults.scaled_wheels, turn=0.3),
    "wheels turn the other way": _fault(faults.scaled_wheels, turn=-1.0),
    "wheels pull aside": _fault(faults.scaled_wheels, bias=0.1),
    "wheels pull aside, no loops": _fault(faults.scaled_wheels, bias=0.03) | _NO_LOOPS,
    "wheels slip": _SLIPS,
    "wheels slip, one scan per 1 s": _SLIPS | _ONE_PER_1_S,
    "wheels slip, short": _SLIPS | _SHORT,
    "wheels late": _fault(faults.late_wheels, seconds=0.3),
    "wheels early": _fault(faults.late_wheels, seconds=-0.5),
    "mount turned 10°": _mount(0.0, 0.0, 0.17),
    "mount turned 30°": _mount(0.0, 0.0, 0.52),
    "mount turned round": _mount(0.0, 0.0, np.pi),
    "mount off": _mount(0.5, 0.2, 0.0),
    "sweep reversed": _fault(faults.reversed_sweep),
    "bearings 0.5": _fault(faults.scaled_bearings, factor=0.5),
    "bearings 1.06": _fault(faults.scaled_bearings, factor=1.06),
    "one scan per 1 s": _ONE_PER_1_S,
    "one scan per 2 s": _ONE_PER_2_S,
    "one scan per 2 s, no wheels": _ONE_PER_2_S | _NO_WHEELS,
    "gaps": _fault(faults.scan_gaps, seconds=5.0, every=20.0),
    "blackout": _fault(faults.blackout, seconds=12.0),
    "short": _SHORT,
    "short, no loops": _SHORT | _NO_LOOPS,
    "short, no wheels": _SHORT | _NO_WHEELS,
    "noise 5 cm": _fault(faults.noisy, metres=0.05),
    "narrow": _fault(faults.narrow, degrees=90.0),
    "narrow, no wheels": _fault(faults.narrow, degrees=60.0) | _NO_WHEELS,
    "few beams": _fault(faults.fewer_beams, every=12),
    "most beams empty": _fault(faults.dropping_out, share=0.8),
    "posts": _fault(faults.with_posts),
    "floor": _fault(faults.sees_floor, metres=3.0),
}
