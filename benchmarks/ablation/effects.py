"""What the same drives with a mechanism and without say of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np
from scipy.stats import t as student

from benchmarks.ablation.ablation_drive import DriveFigures
from benchmarks.harness.table import Column

CONFIDENCE = 0.99
"""Of the interval that a difference lies in, since there are hundreds of them, of which one in a hundred is
called clear by chance."""
EQUAL_WITHIN = 0.1
"""Share of the error by which two are taken for equal, by judgement, since the documented figures scatter by
some hundredths."""


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

    with_m: Annotated[float, Column("with (m)", ".4f")]
    without_m: Annotated[float, Column("without (m)", ".4f")]
    difference_m: Annotated[tuple[float, float], Column("difference (m)", "+.4f")]
    """Mean over the drives, and its standard error; that is infinite of a single drive."""
    share_lost: Annotated[float, Column("lost without", ".1%")]
    effect: Annotated[str, Column("effect")]
    """An `Effect`, by the interval that the difference lies in with a probability of 99 %."""
    drives: int


def difference(default: Sequence[DriveFigures], without: Sequence[DriveFigures]) -> Difference:
    """Of two variants on the same drives."""
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
