"""How to open a bag: the options of the command line, for one bag or for many."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.config import SensorConfig


@dataclass(frozen=True)
class BagReading:
    """Options of `BagReader` besides the settings; where an option is None, the bag decides."""

    scan_topic: tuple[str, ...] = ()
    odom_topic: str | None = None
    imu_topic: str | None = None
    use_odometry: bool = True
    use_imu: bool = True
    base_from_laser: tuple[float, ...] | None = None
    """(3,) or, with a roll, (4,): metres and radians."""
    start: float = 0.0
    """Seconds since the bag's first message."""
    duration: float | None = None
    """Seconds; None reads to the end."""

    def open(self, bag: Path, sensors: SensorConfig) -> BagReader:
        """Open the bag with these options. Raises UserError when it cannot be read."""
        return BagReader(bag, **vars(self), sensors=sensors)


@contextmanager
def opened_bag(bag: str | Path | BagReader, sensors: SensorConfig) -> Iterator[BagReader]:
    """Yield a reader. One that is already open stays open and keeps its own settings where ``sensors`` has
    the defaults. Raises UserError when the path holds no bag."""
    if isinstance(bag, BagReader):
        if sensors != SensorConfig():
            bag.sensors = sensors
        yield bag
        return
    with BagReader(bag, sensors=sensors) as reader:
        yield reader
