"""A bag by its path, or one that is open already, as when its topics are chosen or a part of it is cut."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from racecar.pipelines.bags.reader import BagReader


@contextmanager
def opened_bag(bag: str | Path | BagReader) -> Iterator[BagReader]:
    """Yield a reader; one that was open stays open. Raises UserError when the path holds no bag."""
    if isinstance(bag, BagReader):
        yield bag
        return
    with BagReader(bag) as reader:
        yield reader
