"""The simulated drives of the ablation: those that most mechanisms are for, and some for a single one."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from benchmarks.ablation.ablation_drive import AblationDrive
from benchmarks.accuracy.drives import (
    MAPS,
    Simulate,
    changed_map_drive,
    grid_of,
    kidnapped_drive,
    racing_drive,
    tracking_drive,
)
from benchmarks.harness.input_faults import with_steps, without_wheels
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry

DRIVE_SECONDS = 30.0
"""Default, since those of `python -m benchmarks accuracy` are as long."""
_GAP = 3_000_000_000
"""Nanoseconds, since after two seconds without a scan a car may have been carried anywhere."""
_HANGS = (0.3, 0.6)
"""Shares of the drive between which the odometry hangs: long enough to be noticed, and as much time again
with working odometry. Chosen by judgement, so that both count."""
_HALVES, _HALVED_FOR = (0.25, 0.5, 0.75), 1_000_000_000
"""Shares of the drive at which the odometry begins to report half of the motion, and for how many
nanoseconds: a chain skips or a wheel lifts, after the odometry has proven right."""


def simulated_drives(seconds: float) -> dict[str, Callable[[int], AblationDrive]]:
    """The drives by name, each a function of its seed."""
    return {
        f"{kind}, {name}": partial(_simulated, simulate, name, seconds)
        for kind, simulate in _KINDS.items()
        for name in MAPS
    }


def _simulated(simulate: Simulate, map_name: str, seconds: float, seed: int) -> AblationDrive:
    grid = grid_of(map_name)
    drive = simulate(grid, seed, seconds)
    return AblationDrive(grid, drive.messages, drive.truth, drive.truth.map_from_base[0])


def _without_odometry(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    drive = tracking_drive(grid, seed, seconds, NoiseLevel.SLIGHT)
    return replace(drive, messages=without_wheels(drive.messages))


def _with_hung_odometry(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    drive = tracking_drive(grid, seed, seconds, NoiseLevel.SLIGHT)
    first, last = drive.messages[0].stamp, drive.messages[-1].stamp
    begin, end = (first + round(share * (last - first)) for share in _HANGS)
    messages: list[Measurement] = []
    hung: Odometry | None = None
    for message in drive.messages:
        if isinstance(message, Odometry) and begin <= message.stamp < end:
            hung = message if hung is None else replace(hung, stamp=message.stamp)
            messages.append(hung)
        else:
            messages.append(message)
    return replace(drive, messages=messages)


def _with_halved_odometry(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    drive = tracking_drive(grid, seed, seconds, NoiseLevel.SLIGHT)
    first, last = drive.messages[0].stamp, drive.messages[-1].stamp
    begins = [first + round(share * (last - first)) for share in _HALVES]

    def halved(step: Pose, sample: Odometry) -> Pose:
        return 0.5 * step if any(0 <= sample.stamp - begin < _HALVED_FOR for begin in begins) else step

    return replace(drive, messages=with_steps(drive.messages, halved))


_KINDS: Mapping[str, Simulate] = {
    "noise": partial(tracking_drive, noise=NoiseLevel.FULL),
    "racing": racing_drive,
    "changed map": changed_map_drive,
    "kidnapped": kidnapped_drive,
    "carried in a gap": partial(kidnapped_drive, pause=_GAP),
    "no odometry": _without_odometry,
    "hung odometry": _with_hung_odometry,
    "halved odometry": _with_halved_odometry,
    "gyroscope": partial(tracking_drive, noise=NoiseLevel.FULL, imu_rate=100.0),
}
