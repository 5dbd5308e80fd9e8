"""The mechanisms of the localizer, and how to turn each off: a setting, number or function that is replaced.

Not listed are mechanisms that only save time (the rough stage of the place search, a second thread) or only
reject bad input (messages out of order, clocks set back, maps without walls).
"""

from collections.abc import Mapping
from math import inf, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.variant import Variant, nothing, replacing
from racecar.localization.config import LocalizationConfig
from racecar.localization.filter import particle_filter
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.floor import free_space
from racecar.localization.odometry import motion_source, segments, slip
from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.slip import changed_slips
from racecar.localization.odometry.speed_memory import SpeedMemory
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.recovery import hung_odometry, hypotheses, perception, place_judge, pose_hypothesis
from racecar.localization.recovery.lookout import Lookout
from racecar.localization.recovery.perception import Perception
from racecar.localization.refinement import refinement
from racecar.localization.sensor import end_points, likelihood_field
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field import DEPENDENCE, log_table
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.motion.odometry_buffer import STALE_AFTER, Extrapolation
from racecar.sensors.motion.turn_fusion import TurnFusion

_TAKE = SpeedMemory.take
"""The original method."""
_NONE = 1e-9
"""Almost 0, for settings that must be positive, since everything they are compared with is far larger."""


def _unpushed(
    slips: NDArray[np.float64], seconds: float, effort: NDArray[np.float64], *rest: Any
) -> NDArray[np.float64]:
    """Replaces `changed_slips`: tyres without load."""
    return changed_slips(slips, seconds, np.zeros_like(effort), *rest)


def _slides_nowhere(
    memory: SpeedMemory, step: Pose, seconds: float
) -> tuple[Pose, NDArray[np.float64], Pose]:
    """Replaces `SpeedMemory.take`: a car that stops at once."""
    _, effort, behind = _TAKE(memory, step, seconds)
    return np.abs(step), effort, behind


def _unaligned(map_from_base: Pose, *_: object) -> Pose:
    """Replaces the alignment of a pose with the walls."""
    return map_from_base


def _all_points(_perception: object, _cloud: object, _covariance: object, points: EndPoints) -> EndPoints:
    """Replaces the selection of points that most of the cloud explains."""
    return points


def _independent(deviation: float, surface: float) -> NDArray[np.float32]:
    """Replaces the log-likelihood of an end point: every point counts in full."""
    return np.float32(DEPENDENCE) * log_table(deviation, surface)


_SURVEYED_ANEW = replacing(perception, find_free_space=free_space.find_free_space)
"""Replaces the cached free space that the benchmark uses, which would now be different."""

MECHANISMS: Mapping[str, Mapping[str, Variant]] = {
    "odometry": {
        "calibration": replacing(OdometryCalibration, learn=nothing),
        "trust": replacing(OdometryTrust, learn=nothing),
        "segments": replacing(segments, _SHORTEST=inf),
        "slip": Variant({"slip": 0.0}),
        "usual slip": replacing(slip, _USUAL_SHARE=0.0),
        "pushed slip": replacing(particle_filter, changed_slips=_unpushed),
        "lasting slip": replacing(slip, _LASTING=(_NONE, _NONE, 30.0), _PUSHED_SECONDS=_NONE),
        "lag": replacing(slip, _LAG_DEVIATION=0.0),
        "sliding on": replacing(SpeedMemory, take=_slides_nowhere),
        "extrapolation": replacing(motion_source, _EXTRAPOLATION=Extrapolation(0, 0, STALE_AFTER)),
        "carrying on": replacing(motion_source, _LONGEST_CARRY=_NONE),
        "gyroscope": replacing(TurnFusion, follow=nothing),
    },
    "evidence": {
        "dependent points": replacing(likelihood_field, log_table=_independent),
        "news threshold": replacing(hypotheses, _COUNTS_AFTER=0.0),
        "looking again": replacing(hypotheses, _LOOK_AGAIN_AFTER=inf),
        "dependent scans": replacing(particle_filter, _INDEPENDENT_AFTER=_NONE),
        "evidence cap": replacing(particle_filter, _MOST_EVIDENCE=inf),
        "first scan share": replacing(hypotheses, _FIRST_SCAN_SHARE=1.0),
        "rival discount": replacing(hung_odometry, _SCANS_PER_SECOND=40.0, _LARGEST_RATE=1000.0),
    },
    "explanation": {
        "known place": replacing(pose_hypothesis, _KNOWN_WITHIN=100.0),
        "explained points": replacing(Perception, explained=_all_points),
        "proposals": replacing(ParticleFilter, propose=nothing),
        "alignment": replacing(refinement, align_to_walls=_unaligned),
    },
    "recovery": {
        "particle injection": replacing(ParticleFilter, inject=nothing),
        "moving rival": replacing(hung_odometry, _SCANS_PER_SECOND=0.0),
        "lost detection": replacing(hypotheses, _SEARCH_FROM=1.0),
        "confirmation": replacing(hypotheses, CONFIRMED_BELOW=0.5),
        "hypothesis trial": replacing(pose_hypothesis, _TRIAL=0),
        "restart after gaps": replacing(motion_source, _GAP_SECONDS=1000.0),
        "learned fit": replacing(place_judge, _SURE=inf),
        "lookout": replacing(Lookout, look=nothing),
    },
    "cloud": {
        "fewer particles where sure": Variant({"fewest_particles": LocalizationConfig().particles}),
        "clusters": replacing(particle_filter, _RADIUS=100.0, _HALF_ANGLE=pi),
        "resampling threshold": replacing(particle_filter, _RESAMPLE_BELOW=1.0),
    },
    "sensor": {
        "deskewing": replacing(end_points, _LONGEST_SWEEP=0.0),
        "movable furniture": _SURVEYED_ANEW | replacing(free_space, _LARGEST_MOVABLE=0.0),
        "unknown floor": _SURVEYED_ANEW | replacing(free_space, _UNKNOWN_REACH=0.0),
    },
}
"""What turns each mechanism off, by group and name. Values are bounds, or so far beyond the usual ones that
they have no effect."""


def variants() -> dict[str, Variant]:
    """Each mechanism off alone, and each group off together, by name."""
    every: dict[str, Variant] = {}
    for group, mechanisms in MECHANISMS.items():
        every |= mechanisms
        together = Variant()
        for off in mechanisms.values():
            together = together | off
        every[f"all {group}"] = together
    return every
