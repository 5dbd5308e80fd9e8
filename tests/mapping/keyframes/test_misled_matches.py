"""What wheels and scans contradict each other in is blamed on the side that contradicts itself."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.misled_matches import MatchesAlongPath, poses_by_wheels
from racecar.maps.geometry.se2 import Pose, between, chained, compose

KEYFRAMES, BACK = 300, (1, 2, 4, 7, 11)
STEPS = np.tile([0.4, 0.0, 0.01], (KEYFRAMES - 1, 1))
TRUE = chained(STEPS)
SIGMAS = np.array([0.005, 0.005, 0.001])
CLAIMED = np.diag((2.0 * SIGMAS) ** -2.0)
"""Matches of the same scans err alike, so that cycles of them close better than matches fit the truth."""


def constraints(ends: np.ndarray, motions: Pose, kind: str) -> list[Constraint]:
    return [
        Constraint(int(first), int(end), motion, CLAIMED, kind)  # type: ignore[arg-type]
        for (first, end), motion in zip(ends, motions, strict=True)
    ]


def drive(seed: int, misled: slice, slipping: slice) -> MatchesAlongPath:
    """Scans see ground that moves along in some steps, so that they tell of less motion, some more than
    others; in other steps the wheels slip."""
    generator = np.random.default_rng(seed)
    wheels = STEPS + generator.normal(0.0, [0.003, 0.001, 0.002], STEPS.shape)
    wheels[slipping, 2] += 0.03
    ends = np.array([(k - back, k) for k in range(KEYFRAMES) for back in BACK if back <= k])
    motions = between(TRUE[ends[:, 0]], TRUE[ends[:, 1]])
    motions = compose(motions, generator.normal(0.0, SIGMAS, motions.shape))
    of_misled = np.isin(np.arange(KEYFRAMES - 1), np.arange(KEYFRAMES - 1)[misled])
    until = np.concatenate([[0], np.cumsum(of_misled)])
    motions[:, 0] -= 0.4 * (until[ends[:, 1]] - until[ends[:, 0]]) * generator.uniform(0.0, 1.0, len(ends))
    steps = np.column_stack([np.arange(KEYFRAMES - 1), np.arange(1, KEYFRAMES)])
    return MatchesAlongPath.of(
        constraints(ends, motions, "scan_matching"),
        generator.normal(0.01, 0.001, len(ends)),
        constraints(steps, wheels, "odometry"),
        KEYFRAMES,
    )


NOWHERE = slice(0, 0)


@settings(max_examples=20)
@given(st.integers(0, 1000), st.integers(20, 240))
def test_matches_that_contradict_each_other_are_misled(seed: int, begin: int) -> None:
    there = slice(begin, begin + 40)
    along = drive(seed, there, NOWHERE)
    misled = along.misled_steps()
    assert misled[there].mean() > 0.9
    assert misled.sum() < 40 + 2 * max(BACK)
    left_out = along.are_contradicted(~along.spans.are_over(misled))
    err = np.abs(between(along.spans.motions, between(TRUE[along.spans.first], TRUE[along.spans.end]))[:, 0])
    assert left_out[err > 0.1].mean() > 0.9
    assert left_out[err < 0.02].mean() < 0.1


@settings(max_examples=20)
@given(st.integers(0, 1000), st.integers(20, 240))
def test_wheels_that_slip_are_to_blame_themselves(seed: int, begin: int) -> None:
    along = drive(seed, NOWHERE, slice(begin, begin + 40))
    everything = np.ones(len(along.spans.first), dtype=np.bool_)
    assert along.are_contradicted(everything).mean() > 0.05
    assert not along.misled_steps().any()


def test_matches_that_fit_badly_are_to_blame_though_they_agree_with_each_other() -> None:
    along = drive(0, NOWHERE, slice(100, 140))
    residuals = along.residuals.copy()
    residuals[(along.spans.first >= 100) & (along.spans.first < 140)] *= 1.5
    misled = replace(along, residuals=residuals).misled_steps()
    assert misled[100:140].mean() > 0.9
    assert misled.sum() < 40 + 2 * max(BACK)


def test_scans_that_were_trimmed_contradict_nothing() -> None:
    along = drive(0, NOWHERE, slice(100, 140))
    is_kept = np.ones(KEYFRAMES, dtype=np.bool_)
    is_kept[100:140:2] = False
    left = is_kept[along.spans.first] & is_kept[along.spans.end]
    fewer = replace(along, spans=along.spans.chosen(left), residuals=along.residuals[left])
    assert not fewer.misled_steps().any()


@pytest.mark.parametrize("known", [0, 10])
def test_nothing_is_known_without_wheels_or_with_few_matches(known: int) -> None:
    along = drive(0, slice(100, 140), NOWHERE)
    steps = along.steps.copy()
    steps[known:] = np.nan
    assert not replace(along, steps=steps).misled_steps().any()
    none = MatchesAlongPath.of([], np.empty(0), [], KEYFRAMES)
    assert not none.misled_steps().any()


def test_where_scans_are_misled_the_drive_is_laid_out_by_the_wheels() -> None:
    along = drive(0, NOWHERE, NOWHERE)
    where = np.zeros(KEYFRAMES - 1, dtype=np.bool_)
    where[100:140] = True
    steps = STEPS.copy()
    steps[100:140, 2] += 0.1
    laid_out = poses_by_wheels(chained(steps), along, where)
    assert np.abs(laid_out[:101] - TRUE[:101]).max() < 1e-9
    assert np.abs(between(laid_out, TRUE)[:, 2]).max() < 0.05
    np.testing.assert_allclose(between(laid_out[:-1], laid_out[1:])[~where], STEPS[~where], atol=1e-9)
