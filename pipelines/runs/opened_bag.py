"""A bag by its path, or one that is open already, as when its topics are chosen or a part of it is cut."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.config import SensorConfig


@contextmanager
def opened_bag(bag: str | Path | BagReader, sensors: SensorConfig) -> Iterator[BagReader]:
    """Yield a reader; one that was open stays open, and keeps its settings of ``sensors`` where these are the
    defaults. Raises UserError when the path holds no bag."""
    if isinstance(bag, BagReader):
        if sensors != SensorConfig():
            bag.sensors = sensors
        yield bag
        return
    with BagReader(bag, sensors=sensors) as reader:
        yield reader
