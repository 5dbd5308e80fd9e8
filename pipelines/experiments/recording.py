"""A recording to evaluate a filter on: a bag and the map it was driven on, or a simulated drive."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed, replay
from racecar.pipelines.experiments.filters import simulated_drive
from racecar.pipelines.runs.mapping_drive import MappingDrive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.sentences import by_name

_SEARCHED = 60.0
"""Seconds of the recording in which its start is searched for. Chosen by judgement: wheel odometry leads back
from there to within a metre, which the first scan corrects."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording, and what is known about the car's pose in it."""

    title: str
    """A short description."""
    grid: OccupancyGrid
    """The map to localize on."""
    messages: Callable[[], Iterable[Measurement]]
    """Reads the messages from the beginning, in time order."""
    start: Pose | None
    """(3,) the car's pose at the first scan; None if unknown."""
    end: Sequence[float] | None = None
    """The car's place at the last scan by tape measure: x, y and, if it was measured, yaw."""
    is_real: bool = True
    """Whether it was recorded on a real car."""

    def first(self, seconds: float) -> list[Measurement]:
        """The messages of the first ``seconds`` seconds."""
        messages: list[Measurement] = []
        for message in self.messages():
            if messages and message.stamp > messages[0].stamp + int(seconds * 1e9):
                break
            messages.append(message)
        return messages


def bag_recording(
    bag: Path,
    map: Path,
    opened: Callable[[], BagReader],
    initial_pose: Sequence[float] | None = None,
    end_pose: Sequence[float] | None = None,
) -> Recording:
    """A user's bag; ``opened`` opens it with the user's options.

    It starts at the initial pose or, if the map was made from it, at its start there. Raises UserError for
    any fault of bag or map.
    """
    grid = load_map(map)
    with opened() as reader:
        begin = next((message.stamp for message in reader if isinstance(message, Scan)), None)
    if begin is None:
        raise UserError(f"{bag} holds no usable scan.")
    start = None if initial_pose is None else np.array(initial_pose)
    drive = MappingDrive.beside(map) if start is None else None
    driven = drive.trajectory() if drive is not None and drive.is_of(bag) else None
    if driven is not None:
        start = driven.poses_at(np.array([begin]))[0]

    def messages() -> Iterator[Measurement]:
        with opened() as reader:
            yield from reader

    return Recording(f"{bag.name} on {map.name}", grid, messages, start, end_pose)


def stand_in(seed: int, seconds: float) -> Recording:
    """A simulated drive with people around, for when no recording is given."""
    config = SimulationConfig(noise=NoiseLevel.FULL, seed=seed, duration=seconds, walkers=4, max_speed=2.0)
    drive = simulated_drive("building", config)
    title = "a simulated drive through the shipped building with four people about"
    poses = drive.truth.map_from_base
    return Recording(title, drive.grid, lambda: drive.messages, poses[0], poses[-1].tolist(), is_real=False)


def with_known_start(recording: Recording, config: LocalizationConfig, seed: int) -> Recording:
    """The recording with its start, searched for on the whole map if unknown.

    Wheel odometry leads back to it from the first known pose of the car, and the first scan corrects it.
    Raises UserError when the drive is not localized, or there is no odometry.
    """
    if recording.start is not None:
        return recording
    localizer = Localizer(recording.grid, config, np.random.default_rng(seed))
    judge, samples, estimates = DriveJudge(), list[Odometry](), list[PoseEstimate]()
    for message in recording.first(_SEARCHED):
        if isinstance(message, Odometry):
            samples.append(message)
        estimate = feed(message, localizer)
        if estimate is not None:
            judge.follow(estimate)
            estimates.append(estimate)
    last = max((number for number, estimate in enumerate(estimates) if estimate.is_start), default=0)
    known = [each for each in estimates[last:] if each.is_place_known]
    if not (known and samples and judge.quality.verdict == DriveVerdict.LOCALIZED):
        raise UserError(
            f"Where {recording.title} starts was not found in its first {_SEARCHED:g} s; "
            f"give its initial pose {by_name('initial_pose')}, or the map of the place."
        )
    stamps = np.array([sample.stamp for sample in samples])
    driven = Trajectory(stamps, np.array([sample.odom_from_base for sample in samples]))
    then, now = driven.poses_at(np.array([estimates[0].stamp, known[0].stamp]))
    localizer = Localizer(recording.grid, config, np.random.default_rng(seed))
    localizer.set_pose(compose(known[0].map_from_base, between(now, then)))
    first = next(replay(recording.messages(), localizer))
    return replace(recording, start=first.answer.map_from_base)
