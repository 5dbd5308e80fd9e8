"""``racecar map --record``."""

from pathlib import Path

from racecar.mapping.state.result import MappingResult
from racecar.maps.grid.thinning import thinned
from racecar.maps.map_files import MOST_PIXELS
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.view.recorder import Recorder


def record_mapping(reader: BagReader, result: MappingResult, folder: Path) -> None:
    """Read a bag once more and write its scans at the poses that the finished map gave them.

    Where a scan was taken is known only at the end: loops move what a mapper says on the way.
    """
    trajectory = result.trajectory
    poses = dict(zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True))
    with Recorder(folder, thinned(result.tiled, MOST_PIXELS)) as recorder:
        for message in reader:
            if isinstance(message, Odometry):
                recorder.write_odometry(message)
            elif isinstance(message, Scan) and message.stamp in poses:
                recorder.write_scan(message, poses[message.stamp])
            elif message.stamp > trajectory.stamps[-1]:
                break  # Ctrl-C ended the mapping here
