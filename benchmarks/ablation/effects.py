"""The effect of a mechanism, from the same drives with and without it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np
from scipy.stats import t as student

from benchmarks.ablation.ablation_drive import DriveFigures
from benchmarks.harness.table import Column

CONFIDENCE = 0.99
"""Confidence level of the interval of a difference, since there are hundreds of differences, one in a hundred
of which is called clear by chance."""
EQUAL_WITHIN = 0.1
"""Relative difference up to which errors are equal. Chosen by judgement, since the documented figures scatter
by a few hundredths."""


class Effect(str, Enum):
    """The effect of a mechanism on the error."""

    PAYS = "pays"
    COSTS = "costs"
    EQUAL = "equal"
    """Equal to within a tenth with and without it."""
    IDLE = "idle"
    """It did nothing: all figures are the same on all drives."""
    OPEN = "?"
    """More seeds are needed to decide."""


@dataclass(frozen=True)
class Difference:
    """How much larger a variant's error is than the default's, over the same drives."""

    with_m: Annotated[float, Column("with (m)", ".4f")]
    without_m: Annotated[float, Column("without (m)", ".4f")]
    difference_m: Annotated[tuple[float, float], Column("difference (m)", "+.4f")]
    """Mean over the drives, and its standard error, which is infinite for a single drive."""
    share_lost: Annotated[float, Column("lost without", ".1%")]
    effect: Annotated[str, Column("effect")]
    """An `Effect`, from the 99 % confidence interval of the difference."""
    drives: int


def difference(default: Sequence[DriveFigures], without: Sequence[DriveFigures]) -> Difference:
    """The difference between two variants on the same drives."""
    before, after = (np.array([each.error_m for each in figures]) for figures in (default, without))
    count = len(before)
    error = float(np.std(after - before, ddof=1) / np.sqrt(count)) if count > 1 else np.inf
    with_m, without_m = float(before.mean()), float(after.mean())
    is_idle = list(default) == list(without)
    return Difference(
        with_m=with_m,
        without_m=without_m,
        difference_m=(without_m - with_m, error),
        share_lost=float(np.mean([each.share_lost for each in without])),
        effect=(Effect.IDLE if is_idle else _effect(with_m, without_m - with_m, error, count)).value,
        drives=count,
    )


def _effect(with_m: float, mean_m: float, standard_error_m: float, drives: int) -> Effect:
    if drives < 2:
        return Effect.OPEN
    reach = float(student.ppf(0.5 + 0.5 * CONFIDENCE, drives - 1)) * standard_error_m
    low, high = mean_m - reach, mean_m + reach
    if max(-low, high) <= EQUAL_WITHIN * with_m:
        return Effect.EQUAL
    return Effect.PAYS if low > 0.0 else Effect.COSTS if high < 0.0 else Effect.OPEN
