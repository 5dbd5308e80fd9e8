"""Where a recording starts on a map, found by a search of all of it."""

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.replay import feed, replay
from racecar.pipelines.experiments.recording import Recording, first_seconds
from racecar.sensors.odometry import Odometry

_SECONDS = 60.0
"""Of the recording that are searched: by judgement, as wheels lead back from there to within a metre, which
the first scan corrects."""


def found_start(recording: Recording, config: LocalizationConfig, seed: int) -> Pose:
    """(3,) at the first scan: the wheels lead back to it from where the car was first known to be.

    Raises UserError when the drive is not localized, or there are no wheels.
    """
    localizer = Localizer(recording.load_map(), config, np.random.default_rng(seed))
    judge, samples, estimates = DriveJudge(), list[Odometry](), list[PoseEstimate]()
    for message in first_seconds(recording.messages(), _SECONDS):
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
            f"Where {recording.title} starts was not found in its first {_SECONDS:g} s; "
            "give --initial-pose X Y YAW, or the map of the place."
        )
    driven = Trajectory(
        np.array([sample.stamp for sample in samples]),
        np.array([sample.odom_from_base for sample in samples]),
    )
    then, now = driven.poses_at(np.array([estimates[0].stamp, known[0].stamp]))
    return _matched(recording, config, seed, compose(known[0].map_from_base, between(now, then)))


def _matched(recording: Recording, config: LocalizationConfig, seed: int, start: Pose) -> Pose:
    """The pose (3,) at the first scan, by that scan."""
    localizer = Localizer(recording.load_map(), config, np.random.default_rng(seed))
    localizer.set_pose(start)
    return next(replay(recording.messages(), localizer)).answer.map_from_base
