"""A filter run over scans and odometry, and its estimate at each scan."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.pipelines.bags.replay import ScanConsumer, replay
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan


class Estimate(Protocol):
    """A filter's estimate of the pose."""

    @property
    def map_from_base(self) -> Pose:
        """(3,)"""

    @property
    def effective_sample_size(self) -> float:
        """How many equally weighted particles the cloud was worth."""


class Filter(ScanConsumer[Estimate], Protocol):
    """What `Localizer` and the course's filter have in common."""

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,)."""


@dataclass(frozen=True, eq=False)
class Track:
    """A filter's estimates, one entry per scan; extents and deviations may begin with the cloud as set."""

    stamps: NDArray[np.int64]
    """(S,) nanoseconds."""
    map_from_base: Pose
    """(S, 3)"""
    extents: NDArray[np.float64]
    """(S, 2), or a row more, metres from the first to the last particle, in x and in y."""
    deviations: NDArray[np.float64]
    """(S,), or one more, metres of standard deviation of the particles' place, both axes together."""
    effective_sizes: NDArray[np.float64]
    """(S,) effective sample sizes."""
    update_seconds: NDArray[np.float64]
    """(S,) wall time."""

    @property
    def seconds(self) -> NDArray[np.float64]:
        """(S,) since the first scan."""
        elapsed: NDArray[np.float64] = (self.stamps - self.stamps[0]) * 1e-9
        return elapsed


def track(
    filter_: Filter,
    messages: Iterable[Measurement],
    watch: Callable[[Scan, Estimate], None] = lambda scan, estimate: None,
    *,
    with_start: bool = False,
) -> Track:
    """Feed messages to a filter whose start was set; ``watch`` sees every scan too."""
    stamps, poses, sizes, seconds = [], [], [], []
    clouds = [_cloud(filter_)] if with_start else []
    for replayed in replay(messages, filter_):
        seconds.append(replayed.seconds)
        stamps.append(replayed.scan.stamp)
        poses.append(replayed.answer.map_from_base)
        clouds.append(_cloud(filter_))
        sizes.append(replayed.answer.effective_sample_size)
        watch(replayed.scan, replayed.answer)
    return Track(
        np.array(stamps, dtype=np.int64),
        np.array(poses).reshape(-1, 3),
        np.array([extent for extent, _ in clouds]).reshape(-1, 2),
        np.array([deviation for _, deviation in clouds]),
        np.array(sizes),
        np.array(seconds),
    )


def place_errors(estimated: Pose, true: Pose) -> NDArray[np.float64]:
    """(S,) metres between poses (S, 3)."""
    errors: NDArray[np.float64] = np.hypot(*(estimated - true)[:, :2].T)
    return errors


def heading_errors(estimated: Pose, true: Pose) -> NDArray[np.float64]:
    """(S,) radians between poses (S, 3), not signed."""
    return np.abs(wrap_angle(estimated[:, 2] - true[:, 2]))


def _cloud(filter_: Filter) -> tuple[NDArray[np.float64], float]:
    """The extent (2,) of the particles and the standard deviation of their place, metres."""
    particles, weights = filter_.particles()
    places = particles[:, :2]
    variance = weights @ np.sum((places - weights @ places) ** 2, axis=1)
    return np.ptp(places, axis=0), float(np.sqrt(variance))
