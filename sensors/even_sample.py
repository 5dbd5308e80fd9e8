"""Some values of a sequence whose length is not known."""

from typing import Generic, TypeVar

T = TypeVar("T")


class EvenSample(Generic[T]):
    """Evenly spread over the sequence so far, and bounded, so that memory does not grow with it."""

    def __init__(self, most: int) -> None:
        self.values: list[T] = []
        """Fewer than ``most``, the first among them."""
        self._most, self._stride, self._count = most, 1, 0

    def add(self, value: T) -> None:
        """Take note of the next one."""
        if self._count % self._stride == 0:
            self.values.append(value)
            if len(self.values) >= self._most:
                self.values, self._stride = self.values[::2], self._stride * 2
        self._count += 1
