"""What each mechanism of the localizer is good for: the same drives and seeds with it and without."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from enum import Enum
from functools import lru_cache
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.stats import t as student

from benchmarks.ablation.ablation_drive import AblationDrive, DriveFigures
from benchmarks.ablation.mechanisms import Variant
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.recovery import perception

CONFIDENCE = 0.99
"""Of the interval that a difference lies in, since there are hundreds of them, of which one in a hundred is
called clear by chance."""
EQUAL_WITHIN = 0.1
"""Share of the error by which two are taken for equal, by judgement, since the documented figures scatter by
some hundredths."""
_MAPS_REMEMBERED = 3
"""Maps whose survey is kept, some bytes a cell, since few variants have another than the default."""


class Effect(str, Enum):
    """What an error without a mechanism says of it."""

    PAYS = "pays"
    COSTS = "costs"
    EQUAL = "equal"
    """To within a tenth, with or without."""
    IDLE = "idle"
    """It did nothing: on no drive does any figure differ."""
    OPEN = "?"
    """More seeds are needed to say."""


@dataclass(frozen=True)
class Difference:
    """By how much a variant's error is larger than the default's, over the same drives."""

    with_m: float
    without_m: float
    standard_error_m: float
    """Of the mean difference; infinite of a single drive."""
    drives: int
    is_idle: bool
    """Whether all figures of all drives are the same to the bit."""

    @property
    def mean_m(self) -> float:
        """Of the drives' differences."""
        return self.without_m - self.with_m

    @property
    def effect(self) -> Effect:
        """By the interval that the difference lies in with a probability of 99 %."""
        if self.is_idle:
            return Effect.IDLE
        if self.drives < 2:
            return Effect.OPEN
        reach = float(student.ppf(0.5 + 0.5 * CONFIDENCE, self.drives - 1)) * self.standard_error_m
        low, high = self.mean_m - reach, self.mean_m + reach
        if max(-low, high) <= EQUAL_WITHIN * self.with_m:
            return Effect.EQUAL
        return Effect.PAYS if low > 0.0 else Effect.COSTS if high < 0.0 else Effect.OPEN

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return {**asdict(self), "mean_m": self.mean_m, "effect": self.effect.value}


@dataclass(frozen=True)
class KindFigures:
    """One kind of drive: the figures of each seed's drive, in the same order for every variant."""

    default: list[DriveFigures]
    without: dict[str, list[DriveFigures]]
    """By what was off."""

    def differences(self) -> dict[str, Difference]:
        """By what was off."""
        return {name: difference(self.default, figures) for name, figures in self.without.items()}

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return {
            "default": [asdict(each) for each in self.default],
            "without": {
                name: {**found.as_dict(), "figures": [asdict(each) for each in self.without[name]]}
                for name, found in self.differences().items()
            },
        }


def difference(default: list[DriveFigures], without: list[DriveFigures]) -> Difference:
    """Of two variants on the same drives."""
    before, after = (np.array([each.error_m for each in figures]) for figures in (default, without))
    count = len(before)
    error = float(np.std(after - before, ddof=1) / np.sqrt(count)) if count > 1 else np.inf
    return Difference(float(before.mean()), float(after.mean()), error, count, default == without)


def measure_kind(
    drive_of: Callable[[int], AblationDrive],
    variants: Mapping[str, Variant],
    settings: LocalizationConfig,
    seeds: int,
    announce: Callable[[str], None],
) -> KindFigures:
    """Localize the drive of each seed with everything, and with each variant."""
    default: list[DriveFigures] = []
    without: dict[str, list[DriveFigures]] = {name: [] for name in variants}
    with _surveying_once():
        for seed in range(seeds):
            drive = drive_of(seed)
            default.append(_localized(drive, Variant(), settings, seed))
            announce(f"  seed {seed}: {default[-1].error_m:.4f} m, {default[-1].share_lost:.1%} lost")
            for name, variant in variants.items():
                without[name].append(_localized(drive, variant, settings, seed))
    return KindFigures(default, without)


def _localized(
    drive: AblationDrive, variant: Variant, settings: LocalizationConfig, seed: int
) -> DriveFigures:
    rng = np.random.default_rng(seed)
    with variant.replaced():
        return drive.localized(Localizer(drive.grid, variant.configured(settings), rng))


@contextmanager
def _surveying_once() -> Iterator[None]:
    """What a localizer derives from a map is derived once for all localizers within the block.

    It takes longer than many a drive, and depends on the map and its settings only.
    """
    remember = lru_cache(maxsize=_MAPS_REMEMBERED)
    with ExitStack() as stack:
        for name in ("Walls", "find_free_space", "LikelihoodField", "PlaceSearch"):
            by = remember(getattr(perception, name))
            stack.enter_context(patch.object(perception, name, by))
        yield
