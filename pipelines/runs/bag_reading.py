"""How to open a bag: the options of the command line, for one bag or for many."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path

from numpy.typing import ArrayLike

from racecar.maps.errors import UserError
from racecar.pipelines.bags.car_frames import given_place
from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.config import SensorConfig


@dataclass(frozen=True)
class BagReading:
    """Options of `BagReader` besides the settings; where an option is None, the bag decides."""

    scan_topic: str | Sequence[str] | None = None
    odom_topic: str | None = None
    imu_topic: str | None = None
    use_odometry: bool = True
    use_imu: bool = True
    laser_pose: ArrayLike | None = None
    """(3,) or, with a roll, (4,): metres and radians."""
    start: float = 0.0
    """Seconds since the bag's first message."""
    duration: float | None = None
    """Seconds; None reads to the end."""

    def __post_init__(self) -> None:
        """In one form, so that equal options are equal."""
        topics = [self.scan_topic] if isinstance(self.scan_topic, str) else self.scan_topic or ()
        object.__setattr__(self, "scan_topic", tuple(topics))
        if self.laser_pose is not None:
            object.__setattr__(self, "laser_pose", given_place(self.laser_pose))

    def open(self, bag: Path, sensors: SensorConfig) -> BagReader:
        """Open the bag with these options. Raises UserError when it cannot be read."""
        return BagReader(bag, **vars(self), sensors=sensors)


BAG_DECIDES = BagReading()
"""Nothing is given."""


@contextmanager
def opened_bag(
    bag: str | Path | BagReader, sensors: SensorConfig, reading: BagReading = BAG_DECIDES
) -> Iterator[BagReader]:
    """Yield a reader. One that is already open stays open and keeps its own settings where ``sensors`` has
    the defaults. Raises UserError when the path holds no bag, and when options of ``reading`` come too late
    for an open one."""
    if isinstance(bag, BagReader):
        names = [each.name for each in fields(reading)]
        late = [name for name in names if getattr(reading, name) != getattr(BAG_DECIDES, name)]
        if late:
            raise UserError(f"This BagReader is open already: give {', '.join(late)} to it, or give a path.")
        if sensors != SensorConfig():
            bag.sensors = sensors
        yield bag
        return
    with reading.open(Path(bag), sensors) as reader:
        yield reader
