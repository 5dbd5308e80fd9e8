"""A bounded, contiguous buffer of the latest rows of numbers in order of their stamps."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


class RecentRows:
    """Supports any number of readers or one writer, but not both at once."""

    def __init__(self, columns: int, max_samples: int) -> None:
        self._max_samples = max_samples
        self._all_stamps = np.empty(2 * max_samples, dtype=np.int64)
        self._all_rows = np.empty((2 * max_samples, columns))
        self._begin = self._end = 0

    def __len__(self) -> int:
        return self._end - self._begin

    @property
    def latest_stamp(self) -> int | None:
        """Nanoseconds; None while empty."""
        return int(self._all_stamps[self._end - 1]) if self._end else None

    @property
    def _stamps(self) -> NDArray[np.int64]:
        return self._all_stamps[self._begin : self._end]

    @property
    def _rows(self) -> NDArray[np.float64]:
        return self._all_rows[self._begin : self._end]

    def _append(self, stamp: int, row: ArrayLike) -> None:
        if self._end == len(self._all_stamps):
            count = len(self)
            self._all_stamps[:count], self._all_rows[:count] = self._stamps, self._rows
            self._begin, self._end = 0, count
        self._all_stamps[self._end], self._all_rows[self._end] = stamp, row
        self._end += 1
        self._begin = max(self._begin, self._end - self._max_samples)

    def _clear(self) -> None:
        self._begin = self._end = 0
