import threading

import numpy as np

from racecar.localization.numerics.two_threads import in_two_threads


def test_rows_come_back_in_their_order() -> None:
    rows = np.arange(21.0).reshape(7, 3)
    np.testing.assert_array_equal(in_two_threads(lambda part: part.sum(axis=1), rows), rows.sum(axis=1))


def test_both_halves_are_worked_on_at_once() -> None:
    together = threading.Barrier(2, timeout=10.0)

    def meet(part: np.ndarray) -> np.ndarray:
        together.wait()
        return part

    in_two_threads(meet, np.zeros(10))


def test_one_row_is_enough() -> None:
    np.testing.assert_array_equal(in_two_threads(lambda part: 2.0 * part, np.ones((1, 2))), [[2.0, 2.0]])
