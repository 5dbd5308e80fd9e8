"""Submaps are matched by the scans with the most similar views."""

import numpy as np

from racecar.mapping.loops.submap_matching import nearest_pairs


def test_pairs_that_see_alike_come_first() -> None:
    first = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    second = np.array([[0.1, 0.0, np.pi], [0.5, 0.0, 0.1], [5.2, 0.0, 0.0]])
    a, b = nearest_pairs(first, second, 2)
    assert set(zip(a.tolist(), b.tolist(), strict=True)) == {(0, 1), (1, 2)}
