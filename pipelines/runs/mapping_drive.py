"""The drive that made a map, and whether a bag is its recording."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from racecar.maps.map_files import find_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.run_report import Inputs, read_report
from racecar.pipelines.files.tum import load_tum


@dataclass(frozen=True, eq=False)
class MappingDrive:
    """The drive that made a map."""

    inputs: Inputs
    """What the map was made from."""
    trajectory: Callable[[], Trajectory]
    """Its path; raises UserError when it cannot be read."""

    @classmethod
    def beside(cls, map_path: Path) -> "MappingDrive | None":
        """The drive of which the trajectory is beside a map; None without one."""
        folder = find_map(map_path).parent
        file = folder / "trajectory.tum"
        return cls(read_report(folder).inputs, cache(partial(load_tum, file))) if file.is_file() else None

    def is_of(self, bag: Path) -> bool:
        """Whether it was this bag's: by the bag's content, or else by its path.

        Stamps are not compared: clocks that were never set, and simulated clocks, repeat the same times on
        every drive.
        """
        if self.inputs.bag_fingerprint is None:
            return self.inputs.is_at_path_of(bag)
        return self.inputs.bag_fingerprint == bag_fingerprint(bag)
