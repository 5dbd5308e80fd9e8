"""Input faults for a mapper: each turns the messages of a drive into those of a faulty car."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

Messages = Sequence[Measurement]
_SEED = 5
"""Seed of the random faults, because the same fault must be identical in every run."""
_STEPS_PER_SLIP = 25
"""Odometry steps, half a second for most wheels, over which the slip is constant."""


def without_wheels(messages: Messages) -> list[Measurement]:
    """No odometry."""
    return [message for message in messages if not isinstance(message, Odometry)]


def scaled_wheels(
    messages: Messages, *, forward: float = 1.0, turn: float = 1.0, bias: float = 0.0
) -> list[Measurement]:
    """Wheels that report these shares of their distance and turn, and ``bias`` radians per metre more."""

    def changed(step: Pose, _: Odometry) -> Pose:
        turned = step[2] * turn + bias * float(np.hypot(step[0], step[1]))
        return np.array([step[0] * forward, step[1] * forward, turned])

    return with_steps(messages, changed)


def slipping_wheels(messages: Messages, *, every: int, spread: float) -> list[Measurement]:
    """In one of ``every`` half seconds wheels gain or lose a share of standard deviation ``spread``."""
    generator = np.random.default_rng(_SEED)
    slips = generator.normal(0.0, spread, len(messages)) * (generator.random(len(messages)) < 1.0 / every)
    of_steps = iter(np.repeat(slips, _STEPS_PER_SLIP))
    return with_steps(messages, lambda step, _: step * (1.0 + next(of_steps) * np.array([1, 0, 1])))


def late_wheels(messages: Messages, seconds: float) -> list[Measurement]:
    """Wheels whose clock is ahead by some seconds; negative values are behind."""
    later = round(seconds * 1e9)
    shifted = [replace(m, stamp=m.stamp + later) if isinstance(m, Odometry) else m for m in messages]
    return sorted(shifted, key=lambda message: (message.stamp, isinstance(message, Scan)))


def moved_mount(messages: Messages, moved: Pose) -> list[Measurement]:
    """A laser whose mount differs from its transform by (3,)."""
    return _with_scans(messages, lambda s: replace(s, base_from_laser=compose(s.base_from_laser, moved)))


def reversed_sweep(messages: Messages) -> list[Measurement]:
    """Beams measured in the reverse of the order given by their times."""
    return _with_scans(
        messages, lambda s: replace(s, time_offsets=s.time_offsets.max(initial=0.0) - s.time_offsets)
    )


def scaled_bearings(messages: Messages, factor: float) -> list[Measurement]:
    """A wrong angle increment."""
    return _with_scans(messages, lambda scan: replace(scan, bearings=scan.bearings * factor))


def sparse_scans(messages: Messages, seconds: float) -> list[Measurement]:
    """A logger that keeps one scan per this many seconds."""
    kept: list[Measurement] = []
    last = -np.inf
    for message in messages:
        if isinstance(message, Scan):
            if message.stamp - last < seconds * 1e9:
                continue
            last = message.stamp
        kept.append(message)
    return kept


def scan_gaps(messages: Messages, seconds: float, every: float) -> list[Measurement]:
    """No scans for ``seconds`` out of ``every`` seconds."""
    since = [(message.stamp - messages[0].stamp) * 1e-9 for message in messages]
    return [
        message
        for message, at in zip(messages, since, strict=True)
        if not isinstance(message, Scan) or at % every <= every - seconds
    ]


def blackout(messages: Messages, seconds: float) -> list[Measurement]:
    """No messages at all for some seconds in the middle."""
    middle = (messages[0].stamp + messages[-1].stamp) // 2
    return [message for message in messages if not 0 < message.stamp - middle < seconds * 1e9]


def short_sighted(messages: Messages, metres: float) -> list[Measurement]:
    """A laser with a shorter range."""
    return _with_scans(
        messages,
        lambda s: replace(s, ranges=np.where(s.ranges > metres, np.inf, s.ranges), max_range=metres),
    )


def noisy(messages: Messages, metres: float) -> list[Measurement]:
    """Ranges with additional noise of this standard deviation."""
    generator = np.random.default_rng(_SEED)
    return _with_scans(
        messages, lambda s: replace(s, ranges=s.ranges + generator.normal(0.0, metres, len(s.ranges)))
    )


def dropping_out(messages: Messages, share: float) -> list[Measurement]:
    """A share of the beams has no return."""
    generator = np.random.default_rng(_SEED)
    return _with_scans(
        messages,
        lambda s: replace(s, ranges=np.where(generator.random(len(s.ranges)) < share, np.inf, s.ranges)),
    )


def fewer_beams(messages: Messages, every: int) -> list[Measurement]:
    """One beam in ``every``."""
    return _with_scans(messages, lambda scan: _beams(scan, slice(None, None, every)))


def narrow(messages: Messages, degrees: float) -> list[Measurement]:
    """A laser with this field of view, straight ahead."""
    half = np.radians(degrees) / 2.0
    return _with_scans(messages, lambda scan: _beams(scan, np.abs(scan.bearings) < half))


def with_posts(messages: Messages) -> list[Measurement]:
    """Two posts of the robot itself in view."""

    def hidden(scan: Scan) -> Scan:
        ranges = scan.ranges.copy()
        ranges[(scan.bearings > 0.5) & (scan.bearings < 0.9)] = 0.45
        ranges[(scan.bearings > -1.2) & (scan.bearings < -1.0)] = 0.6
        return replace(scan, ranges=ranges)

    return _with_scans(messages, hidden)


def sees_floor(messages: Messages, metres: float) -> list[Measurement]:
    """A laser that looks down and hits the floor this far ahead."""

    def tilted(scan: Scan) -> Scan:
        floor = metres / np.maximum(np.cos(scan.bearings), 0.2)
        ahead = np.abs(scan.bearings) < np.pi / 3.0
        return replace(scan, ranges=np.where(ahead, np.minimum(scan.ranges, floor), scan.ranges))

    return _with_scans(messages, tilted)


def _beams(scan: Scan, chosen: "slice | np.ndarray") -> Scan:
    return replace(
        scan,
        bearings=scan.bearings[chosen],
        ranges=scan.ranges[chosen],
        time_offsets=scan.time_offsets[chosen],
    )


def _with_scans(messages: Messages, changed: Callable[[Scan], Scan]) -> list[Measurement]:
    return [changed(message) if isinstance(message, Scan) else message for message in messages]


def with_steps(messages: Messages, changed: Callable[[Pose, Odometry], Pose]) -> list[Measurement]:
    """Odometry integrated from ``changed`` steps, each passed with the sample at its end."""
    before: Odometry | None = None
    place = IDENTITY
    anew: list[Measurement] = []
    for message in messages:
        if not isinstance(message, Odometry):
            anew.append(message)
            continue
        if before is None:
            place = message.odom_from_base
        else:
            step = between(before.odom_from_base, message.odom_from_base)
            place = compose(place, changed(step, message))
        before = message
        anew.append(replace(message, odom_from_base=place))
    return anew
