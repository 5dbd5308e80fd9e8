"""Constraints come out of their list as they went in, and say how much each step may err."""

from dataclasses import astuple
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind
from racecar.mapping.graph.graph_edges import GraphEdges


def drawn(count: int, seed: int) -> list[Constraint]:
    rng = np.random.default_rng(seed)
    roots = rng.normal(size=(count, 3, 3))
    return [
        Constraint(*rng.integers(0, 10**6, 2).tolist(), rng.normal(size=3), root + root.T, kind)
        for root, kind in zip(roots, rng.choice(get_args(Kind), count), strict=True)
    ]


def are_same(first: list[Constraint], second: ConstraintList) -> bool:
    pairs = list(zip(first, second, strict=True))
    return all(
        np.array_equal(np.asarray(a), np.asarray(b))
        for one, other in pairs
        for a, b in zip(astuple(one), astuple(other), strict=True)
    )


@given(st.integers(0, 20), st.integers(0, 20), st.integers(0, 2**32))
def test_a_list_holds_what_was_put_in(count: int, more: int, seed: int) -> None:
    constraints = drawn(count + more, seed)
    packed = ConstraintList(constraints[:count])
    copied = packed.copy()
    for constraint in constraints[count:]:
        packed.append(constraint)
    assert len(packed) == count + more
    assert are_same(constraints, packed)
    assert are_same(constraints[:count], copied)
    assert are_same(constraints, ConstraintList.from_arrays(packed.to_arrays()))
    assert packed.ends.tolist() == [[each.from_keyframe, each.to_keyframe] for each in constraints]
    chosen = np.random.default_rng(seed).permutation(len(packed))[: count // 2]
    assert are_same([constraints[k] for k in chosen], packed.chosen(chosen))


STRAIGHT = np.column_stack([np.arange(40.0), np.zeros(40), np.zeros(40)])


def over(steps: int, missed: float = 0.0, kind: Kind = "scan_matching") -> list[Constraint]:
    """From each keyframe to the one so many steps on: 0.1 m along and across, 0.01 rad; ``missed`` metres."""
    information = np.diag([100.0, 100.0, 1e4])
    measured = np.array([steps + missed, 0.0, 0.0])
    return [Constraint(k, k + steps, measured, information, kind) for k in range(len(STRAIGHT) - steps)]


def variances(constraints: list[Constraint]) -> np.ndarray:
    return GraphEdges.of(ConstraintList(constraints), STRAIGHT).step_variances(0, len(STRAIGHT))


def test_a_chain_of_single_steps_errs_as_each_states() -> None:
    of_steps = variances(over(1))
    np.testing.assert_allclose(of_steps[1:], [[0.02, 1e-4]] * 39)
    np.testing.assert_array_equal(of_steps[0], 0.0)


def test_constraints_over_more_steps_say_more_of_each() -> None:
    np.testing.assert_allclose(variances(over(4))[4:], np.tile([0.005, 0.25e-4], (36, 1)))
    assert (variances([*over(1), *over(4)])[4:] < variances(over(4))[4:]).all()


@pytest.mark.parametrize("missed", [0.5, 1.0])
def test_what_residuals_contradict_is_worth_less(missed: float) -> None:
    squared = missed**2 * 100.0 / 3.0
    np.testing.assert_allclose(variances(over(1, missed))[1:], np.tile([0.02, 1e-4], (39, 1)) * squared)


def test_loop_closures_say_nothing_of_the_steps() -> None:
    loops = over(7, kind="loop_closure")
    np.testing.assert_array_equal(variances([*over(1), *loops]), variances(over(1)))
