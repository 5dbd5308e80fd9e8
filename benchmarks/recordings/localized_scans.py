"""The scans of a recording as placed by the localizer, and the path segments around them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.recordings.exhaustive_matcher import ScanSegment
from racecar.localization.localizer import Localizer
from racecar.localization.sensor.end_points import select_points
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.replay import replay
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_EVERY = 8
"""Scans per scan that is used: at 40 a second the others show the same walls."""


@dataclass(frozen=True, eq=False)
class LocalizedScans:
    """The scans of a recording and the localizer's poses for them."""

    scans: list[Scan]
    map_from_base: Pose
    """(S, 3)"""
    searches: int
    """Number of place searches."""

    def segment_about(self, index: int, own_trajectory: Trajectory, reach: int) -> ScanSegment:
        """One in eight of the ``reach`` scans before and after a scan (a multiple of eight), relative to its
        pose.

        ``own_trajectory`` lies on the map made from the recording; it also gives the car's motion during each
        sweep.
        """
        first = max(index % _EVERY, index - reach)
        scans = self.scans[first : index + reach + 1 : _EVERY]
        driven = dict(zip(own_trajectory.stamps.tolist(), own_trajectory.map_from_base, strict=True))
        own_from_base = np.array([driven[scan.stamp] for scan in scans])
        points = [select_points(scan, len(scan.bearings), own_trajectory.poses_at) for scan in scans]
        return ScanSegment(points, between(driven[self.scans[index].stamp], own_from_base))


def localize(messages: Iterable[Measurement], localizer: Localizer) -> LocalizedScans:
    """Feed all messages to a localizer."""
    scans, poses, searches = [], [], 0
    for replayed in replay(messages, localizer):
        searches += replayed.answer.is_start
        scans.append(replayed.scan)
        poses.append(replayed.answer.map_from_base)
    return LocalizedScans(scans, np.array(poses), searches)
