"""Constraints come out of their list as they went in."""

from dataclasses import astuple
from typing import get_args

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind


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
