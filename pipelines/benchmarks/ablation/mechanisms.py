"""The mechanisms of the localizer, and what turns each off: a setting at its bound, or a function replaced.

A mechanism that settings turn off only nearly, or together with others, has a function replaced instead. Not
listed is what only saves time (the rough stage of the place search, a second thread), or only
refuses bad input (messages out of order, clocks set back, maps without walls).
"""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from math import inf
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.recovery import place_judge
from racecar.localization.recovery.lookout import Lookout
from racecar.localization.sensor import beams, likelihood_field
from racecar.localization.sensor.likelihood_field import DEPENDENCE, log_table

Replacement = tuple[object, str, object]
"""A class or module, the name of something in it, and what that is replaced by."""

_NONE = 1e-9
"""As good as 0 where a setting must be above it, since all that it is compared with is far larger."""


@dataclass(frozen=True)
class Variant:
    """The localizer with something off."""

    changes: Mapping[str, Any] = field(default_factory=dict)
    """Of `LocalizationConfig`, nested as that is."""
    replacements: tuple[Replacement, ...] = ()

    def configured(self, settings: LocalizationConfig) -> LocalizationConfig:
        """The settings with the changes."""
        return LocalizationConfig.model_validate(_over(settings.model_dump(), self.changes))

    @contextmanager
    def replaced(self) -> Iterator[None]:
        """The functions are replaced within the block."""
        with ExitStack() as stack:
            for owner, name, by in self.replacements:
                stack.enter_context(patch.object(owner, name, by))
            yield

    def __or__(self, other: "Variant") -> "Variant":
        """Both off together."""
        changes = _over(self.changes, other.changes)
        return Variant(changes, self.replacements + other.replacements)


def _over(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested values with the changes in their places."""
    changed = dict(values)
    for name, change in changes.items():
        before = values.get(name)
        if isinstance(change, Mapping) and isinstance(before, Mapping):
            changed[name] = _over(before, change)
        else:
            changed[name] = change
    return changed


def _settings(**changes: Any) -> Variant:
    return Variant(changes)


def _slips(**changes: float) -> Variant:
    return _settings(particle_filter={"slips": changes})


def _replaced(owner: object, name: str, by: object) -> Variant:
    return Variant(replacements=((owner, name, by),))


def _nothing(*_: object, **__: object) -> None:
    """In place of a method that learns or changes something."""


def _sees_nothing(*_: object) -> tuple[float, None]:
    """In place of a look at a part of the map."""
    return inf, None


def _independent(deviation: float) -> NDArray[np.float32]:
    """In place of what an end point adds to the log-likelihood, of points that each count as one."""
    return np.float32(DEPENDENCE) * log_table(deviation)


MECHANISMS: Mapping[str, Mapping[str, Variant]] = {
    "odometry": {
        "calibration": _settings(odometry_calibration={"farthest": _NONE}),
        "trust": _replaced(OdometryTrust, "learn", _nothing),
        "segments": _settings(odometry_segments={"shortest": 100.0, "longest": 100.0}),
        "slip": _settings(slip=0.0),
        "usual slip": _slips(usual_share=0.0),
        "pushed slip": _settings(speed_memory={"grip": 1000.0}),
        "lasting slip": _slips(distance_seconds=_NONE, turn_seconds=_NONE, pushed_seconds=_NONE),
        "lag": _slips(lag_deviation=0.0),
        "sliding on": _settings(speed_memory={"slide_seconds": _NONE}),
        "extrapolation": _settings(motion={"longest_extrapolation": 0.0}),
        "carrying on": _settings(motion={"longest_carry": _NONE}),
        "gyroscope": _settings(turn_fusion={"min_segments": 1000}),
    },
    "evidence": {
        "dependent points": _replaced(likelihood_field, "log_table", _independent),
        "news threshold": _settings(tracking={"news_after": 0.0}),
        "looking again": _settings(tracking={"look_again_after": 100.0}),
        "evidence cap": _settings(particle_filter={"least_evidence": 1000.0, "most_evidence": 1000.0}),
        "first scan share": _settings(tracking={"first_scan_share": 1.0}),
        "alignment discount": _settings(
            alignment={"points_per_observation": 1.0, "cloud_width": 1.0, "least_cloud": 0.001}
        ),
        "rival discount": _settings(moving_rival={"scans_per_second": 40.0, "largest_rate": 1000.0}),
    },
    "explanation": {
        "known place": _settings(tracking={"known_within": 100.0}),
        "alignment": _settings(alignment={"fewest_points": 10_000}),
        "alignment widths": _settings(alignment={"scales": (0.07,) * 6}),
    },
    "recovery": {
        "particle injection": _replaced(ParticleFilter, "inject", _nothing),
        "moving rival": _settings(moving_rival={"scans_per_second": _NONE}),
        "lost detection": _settings(hypothesis={"search_from": 1.0 - _NONE}),
        "confirmation": _settings(hypothesis={"confirmed_below": 0.5}),
        "hypothesis trial": _settings(hypothesis={"trial_seconds": _NONE}),
        "restart after gaps": _settings(motion={"gap_seconds": 1000.0}),
        "learned fit": _replaced(place_judge, "_SURE", inf),
        "lookout": _replaced(Lookout, "look", _sees_nothing),
    },
    "cloud": {
        "fewer particles where sure": _settings(fewest_particles=LocalizationConfig().particles),
        "clusters": _settings(particle_filter={"clusters": {"radius": 100.0, "half_angle": 3.14159}}),
        "resampling threshold": _settings(particle_filter={"resample_below": 1.0}),
    },
    "sensor": {
        "deskewing": _replaced(beams, "_LONGEST_SWEEP", 0.0),
        "movable furniture": _settings(free_space={"largest_movable": 0.0}),
        "unknown floor": _settings(free_space={"unknown_reach": 0.0}),
    },
}
"""By group, by name: what turns each off; values are bounds of the settings, or so far beyond the usual ones
that nothing is compared with them any more."""


def variants() -> dict[str, Variant]:
    """Every mechanism off alone, and each group off together, by name."""
    every: dict[str, Variant] = {}
    for group, mechanisms in MECHANISMS.items():
        every |= mechanisms
        together = Variant()
        for off in mechanisms.values():
            together = together | off
        every[f"all {group}"] = together
    return every
