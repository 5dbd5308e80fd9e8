"""How to interpret the numbers in LaserScan messages that cannot be right as stated.

Drivers send angles in degrees, an increment for another number of beams, ranges in millimetres or
centimetres, and misses as a number below ``range_max``. The scans themselves show which.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.sensors.config import SensorConfig
from racecar.sensors.even_sample import EvenSample
from racecar.sensors.findings import Finding
from racecar.sensors.scan import LONGEST_RANGE

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__LaserScan

_READ = 3000
"""Messages read, so a car that stands at first is also seen driving; takes a fraction of a second."""
_SCANS = 300
"""Evenly spaced ones of these that are examined: enough for all the statistics here."""
_TURN = 2 * np.pi
"""Radians, by definition."""
WIDEST = 1.02 * _TURN
"""Largest span of a sweep in radians; some sensors overlap by a few degrees where they begin."""
_NARROWEST = np.radians(5.0)
"""Smallest span of a sweep in radians. Chosen by judgement: nobody maps with less."""
_LEAST_CONTRADICTION = 2.5
"""Increments between the last beam and ``angle_max``. Drivers are off by one or two, depending on whether
they count beams or the steps between them."""
_WALL = np.radians(30.0)
"""Radians of a piece of a scan that is tested for being a straight wall. At 3 m it would be curved by 10 cm
if the increment were half as long, while laser errors are 1 to 3 cm."""
_CLEARLY = 0.75
"""A piece counts if its residual is below this share of that under another reading; clutter is equally
crooked under all. Chosen by judgement."""
_MAJORITY, _ENOUGH = 0.7, 20
"""Share of the counted pieces, and their number, that decide a reading. Chosen by judgement."""
_ABSURD_RANGE, _FARTHEST = 200.0, 60_000.0
"""A median range between these is in millimetres: in metres, half of all beams would go farther than planar
scanners see, and above the second value they would in millimetres too."""
_MEDIANS_IN_CENTIMETRES = 30.0, 2000.0
"""Median ranges: half of all returns, even in a hall, are between 0.3 and 20 m away. Chosen by judgement."""
_NOISE_IN_CENTIMETRES = 0.2, 3.0
"""Range noise: lasers err by 0.2 to 3 cm; in metres it would be less, in millimetres more."""
_SPIKE = 10
"""A range that stands for a miss is at least this many times as frequent as any slightly shorter one. Noise
spreads measurements over several values, even on a flat wall. Chosen by judgement."""
_LITTLE_LESS = 0.7
"""Share of that range. Chosen by judgement: a room has other distances within it."""
_BEYOND = 1e-3
"""Most stray returns beyond that range, as a share of its count. Chosen by judgement."""
_BEARINGS, _SCANS_WITH = 0.03, 0.2
"""Least shares of all bearings and scans in which that range occurs, since doors and gaps are seen from many
places. Chosen by judgement."""


class Angles(Enum):
    """Meaning of ``angle_min``, ``angle_max`` and ``angle_increment``."""

    STATED = "by angle_min and angle_increment"
    SPREAD = "as spread evenly from angle_min to angle_max"
    DEGREES = "as degrees"
    SPREAD_DEGREES = "as spread evenly from angle_min to angle_max, in degrees"
    INCREMENT_IN_DEGREES = "with angle_min in radians and angle_increment in degrees"
    TURN = "as spread evenly over one turn"
    FROM_LAST = "from angle_max on, by angle_increment"

    def first_and_increment(
        self, angle_min: float, angle_max: float, increment: float, count: int
    ) -> tuple[float, float]:
        """Radians of the first beam, and from each beam to the next."""
        if self == Angles.TURN:
            return float(angle_min), float(np.copysign(_TURN / max(count, 1), increment))
        if self == Angles.FROM_LAST:
            return float(angle_max), float(increment)
        is_spread = self in (Angles.SPREAD, Angles.SPREAD_DEGREES)
        step = (angle_max - angle_min) / max(count - 1, 1) if is_spread else increment
        is_in_degrees = self in (Angles.DEGREES, Angles.SPREAD_DEGREES)
        first = np.radians(angle_min) if is_in_degrees else angle_min
        is_step_in_degrees = is_in_degrees or self == Angles.INCREMENT_IN_DEGREES
        return float(first), float(np.radians(step) if is_step_in_degrees else step)


@dataclass(frozen=True)
class ScanReading:
    """How to interpret the messages of one topic."""

    angles: Angles = Angles.STATED
    unit: float = 1.0
    """Metres per unit of range."""
    nearest_miss: float = np.inf
    """Metres from which a reading is a miss."""


AS_STATED = ScanReading()
"""Values as defined by the message, which most drivers send."""


@dataclass(frozen=True, eq=False)
class ScanSetup:
    """What is known about a sensor before its messages are converted; a converter uses what it needs."""

    place: SensorPlace
    longest_sweep: float
    """Seconds; beam times are ignored if they make a sweep longer."""
    points_are_in_base: bool = False
    """Whether points are in the base frame instead of the sensor's."""
    reading: ScanReading = AS_STATED
    """How to interpret the numbers in messages with beams."""
    config: SensorConfig = field(default_factory=SensorConfig)


def learn_reading(
    messages: "Iterable[sensor_msgs__msg__LaserScan]",
) -> tuple[ScanReading, list[Finding]]:
    """Learn from the first messages of a topic how to read all of them, and what is wrong with them."""
    sample = _spread_sample(messages)
    if not sample:
        return AS_STATED, []
    angles, of_angles = _learn_angles(sample)
    unit, of_unit = _learn_unit(sample)
    nearest_miss, of_misses = _learn_nearest_miss(sample, unit)
    return ScanReading(angles, unit, nearest_miss), [*of_angles, *of_unit, *of_misses]


def _spread_sample(
    messages: "Iterable[sensor_msgs__msg__LaserScan]",
) -> "list[sensor_msgs__msg__LaserScan]":
    sample: EvenSample[sensor_msgs__msg__LaserScan] = EvenSample(_SCANS + 1)
    for message in islice(messages, _READ):
        if len(message.ranges) > 1:
            sample.add(message)
    return sample.values


def _learn_angles(sample: "Sequence[sensor_msgs__msg__LaserScan]") -> tuple[Angles, list[Finding]]:
    if varying := _varying_counts(sample):
        return varying
    doubtful = [message for message in sample if not _agree(message)]
    if len(doubtful) <= len(sample) / 2:
        return Angles.STATED, []
    message = doubtful[0]
    count = len(message.ranges)
    steps: dict[Angles, float] = {}
    for angles in Angles:
        first, step = angles.first_and_increment(
            message.angle_min, message.angle_max, message.angle_increment, count
        )
        is_new = all(abs(step - other) > 0.02 * abs(other) for other in steps.values())
        if is_new and abs(first) <= WIDEST and _NARROWEST <= abs(step) * (count - 1) <= WIDEST:
            steps[angles] = step
    stated: dict[str, Any] = {
        "beams": count,
        "first": message.angle_min,
        "step": message.angle_increment,
        "last": message.angle_max,
        "is_beyond_a_turn": _end_as_stated(message),
    }
    if _runs_backwards(message):
        reading = Angles.FROM_LAST
        evidence = "as drivers of lasers that turn the other way round mean it"
        return reading, [Finding("angles_not_as_stated", reading=reading.value, evidence=evidence, **stated)]
    if not steps:
        finding = Finding("angles_not_as_stated", spoils_map=True, reading="", evidence="", **stated)
        return Angles.STATED, [finding]
    best = _straightest(doubtful, steps) if len(steps) > 1 else next(iter(steps))
    chosen = best or next(iter(steps))
    evidence = "which makes walls straight" if len(steps) > 1 else "since nothing else makes sense"
    if best is None:
        evidence = "though the scans do not show whether that is right"
    return chosen, [
        Finding(
            "angles_not_as_stated",
            spoils_map=best is None,
            reading=chosen.value,
            evidence=evidence,
            **stated,
        )
    ]


def _varying_counts(
    sample: "Sequence[sensor_msgs__msg__LaserScan]",
) -> tuple[Angles, list[Finding]] | None:
    """Detect sensors that turn unevenly: some of their scans have more beams than lead to ``angle_max``, some
    fewer, all with the same stated angles and span. If beams were lost, no scan has too many."""
    stated = {(each.angle_min, each.angle_max, each.angle_increment) for each in sample}
    (angle_min, angle_max, increment) = next(iter(stated))
    steps = (angle_max - angle_min) / increment if increment else np.nan
    if len(stated) > 1 or not np.isfinite(steps) or steps < 1.0 or abs(angle_max - angle_min) > WIDEST:
        return None
    counts = np.array([len(message.ranges) for message in sample])
    beyond = counts - 1 - steps
    if beyond.max() < _LEAST_CONTRADICTION or beyond.min() > -_LEAST_CONTRADICTION:
        return None
    return Angles.SPREAD, [
        Finding(
            "beams_vary",
            fewest=counts.min(),
            most=counts.max(),
            step=increment,
            last=angle_max,
            reading=Angles.SPREAD.value,
        )
    ]


def _agree(message: "sensor_msgs__msg__LaserScan") -> bool:
    """Are the angles consistent and plausible?"""
    span = message.angle_increment * (len(message.ranges) - 1)
    if not np.isfinite(span) or span == 0.0:
        return True  # only one reading is left, which the converter uses
    return _end_as_stated(message) and bool(abs(span) <= WIDEST)


def _end_as_stated(message: "sensor_msgs__msg__LaserScan") -> bool:
    """Do angle_min, the increment and the number of beams lead to angle_max?"""
    span = message.angle_increment * (len(message.ranges) - 1)
    return bool(abs(message.angle_min + span - message.angle_max) <= _tolerance(message))


def _tolerance(message: "sensor_msgs__msg__LaserScan") -> float:
    """Radians by which the angles of a message that agree may differ."""
    beams = len(message.ranges) - 1
    return abs(message.angle_increment) * max(_LEAST_CONTRADICTION, 0.01 * beams)


def _runs_backwards(message: "sensor_msgs__msg__LaserScan") -> bool:
    """Do only the signs contradict each other: the increment leads from angle_max to angle_min?"""
    span = message.angle_increment * (len(message.ranges) - 1)
    off = abs(message.angle_max + span - message.angle_min)
    return bool(off <= _tolerance(message) and abs(span) <= WIDEST)


def read_from_the_other_end(reading: ScanReading, finding: Finding) -> tuple[ScanReading, Finding]:
    """The other reading of angles of which only the signs contradict each other, as the turns show it."""
    other = replace(reading, angles=Angles.SPREAD)
    numbers = {**finding.numbers, "reading": Angles.SPREAD.value, "evidence": "as the turns show"}
    return other, Finding(finding.name, **numbers)


def _straightest(
    messages: "Sequence[sensor_msgs__msg__LaserScan]", steps: dict[Angles, float]
) -> Angles | None:
    """The reading under which walls are straight; None if the scans do not decide.

    On a straight wall the inverse range is a cosine of the bearing. The readings are compared by the residual
    of each piece of a scan after fitting a cosine with their increment.
    """
    count = len(messages[0].ranges)
    width = int(np.clip(_WALL / max(abs(step) for step in steps.values()), 7, max(count // 2, 7)))
    scans = np.array([message.ranges for message in messages if len(message.ranges) == count], np.float64)
    if count < width:
        return None
    pieces = np.lib.stride_tricks.sliding_window_view(scans, width, axis=1)[:, :: width // 2]
    pieces = pieces.reshape(-1, width)
    low, high = messages[0].range_min, messages[0].range_max
    is_whole = ((pieces > max(low, 0.0)) & (pieces < (high if high > 0 else np.inf))).all(axis=1)
    pieces = pieces[is_whole]
    inverse = 1.0 / pieces[pieces.max(axis=1) < 3.0 * pieces.min(axis=1)]
    residuals = np.array([_unexplained(inverse, step) for step in steps.values()]).T
    second, best = np.partition(residuals, 1, axis=1)[:, 1], np.argmin(residuals, axis=1)
    counting = best[residuals.min(axis=1) < _CLEARLY * second]
    votes = np.bincount(counting, minlength=len(steps))
    if len(counting) < _ENOUGH or votes.max() < _MAJORITY * len(counting):
        return None
    return list(steps)[int(np.argmax(votes))]


def _unexplained(inverse_ranges: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """(N,) residuals of pieces (N, W) from a cosine with beams ``step`` radians apart."""
    bearings = step * np.arange(inverse_ranges.shape[1])
    basis, _ = np.linalg.qr(np.column_stack([np.cos(bearings), np.sin(bearings)]))
    left: NDArray[np.float64] = inverse_ranges - inverse_ranges @ basis @ basis.T
    unexplained: NDArray[np.float64] = np.sqrt(np.einsum("ij,ij->i", left, left))
    return unexplained


def _learn_unit(sample: "Sequence[sensor_msgs__msg__LaserScan]") -> tuple[float, list[Finding]]:
    ranges = np.concatenate([message.ranges for message in sample])
    ranges = ranges[np.isfinite(ranges) & (ranges > 0.0)]
    median = float(np.median(ranges)) if len(ranges) else 0.0
    if _are_centimetres(sample, ranges, median):
        return 1e-2, [Finding("ranges_in_another_unit", median=median, unit="centimetres")]
    if median <= _ABSURD_RANGE:
        return 1.0, []
    if median > _FARTHEST:
        return 1.0, [Finding("ranges_absurd", spoils_map=True, median=median)]
    return 1e-3, [Finding("ranges_in_another_unit", median=median, unit="millimetres")]


def _are_centimetres(
    sample: "Sequence[sensor_msgs__msg__LaserScan]", ranges: NDArray[np.float64], median: float
) -> bool:
    """Whether ranges (N,) are too large to be metres, for this or any sensor, plausible as centimetres, and
    as noisy as centimetres would be."""
    stated = sample[0].range_max
    is_possible = median <= min(_ABSURD_RANGE, stated) and stated <= LONGEST_RANGE
    nearest, farthest = _MEDIANS_IN_CENTIMETRES
    if is_possible or not nearest <= median <= farthest:
        return False
    reach = min(limits(sample[0], 1e-2)[1], _ABSURD_RANGE)
    lowest, highest = _NOISE_IN_CENTIMETRES
    return bool(np.quantile(ranges, 0.9) * 1e-2 <= reach and lowest <= _noise_of(sample) <= highest)


def _noise_of(sample: "Sequence[sensor_msgs__msg__LaserScan]") -> float:
    """Standard deviation of the stated ranges, from the difference between a beam and the mean of its
    neighbours; inf if none are on one wall."""
    differences = []
    for message in sample:
        ranges = np.asarray(message.ranges, dtype=np.float64)
        triples = np.lib.stride_tricks.sliding_window_view(ranges, min(3, len(ranges)))
        triples = triples[np.isfinite(triples).all(axis=1) & (triples > 0.0).all(axis=1)]
        if triples.shape[1] == 3:
            on_wall = triples[triples.max(axis=1) < 1.1 * triples.min(axis=1)]
            differences.append(np.abs(on_wall @ [1.0, -2.0, 1.0]))
    found = np.concatenate(differences) if differences else np.empty(0)
    return float(np.median(found)) / (0.6745 * np.sqrt(6.0)) if len(found) else np.inf


def _learn_nearest_miss(
    sample: "Sequence[sensor_msgs__msg__LaserScan]", unit: float
) -> tuple[float, list[Finding]]:
    """The range below ``range_max`` that stands for a miss; inf if there is none."""
    spikes = [_returns(message, unit) for message in sample]
    ranges = np.concatenate([returns for _, returns in spikes])
    if len(ranges) == 0:
        return np.inf, []
    values, counts = np.unique(ranges, return_counts=True)
    beyond = len(ranges) - np.cumsum(counts)
    is_far = beyond <= _BEYOND * counts
    spike = int(np.argmax(np.where(is_far, counts, 0)))
    value = values[spike]
    less = counts[(values > _LITTLE_LESS * value) & (values < value)]
    if counts[spike] == len(ranges) or counts[spike] < _SPIKE * max(less, default=1):
        return np.inf, []
    at = [beams[returns == value] for beams, returns in spikes]
    bearings, beams = len(np.unique(np.concatenate(at))), max(len(message.ranges) for message in sample)
    scans = np.mean([len(each) > 0 for each in at])
    if bearings < max(_BEARINGS * beams, 5) or scans < _SCANS_WITH:
        return np.inf, []
    return float(value), [
        Finding("misses_as_a_range", share=counts[spike] / len(ranges), metres=value, bearings=bearings)
    ]


def _returns(
    message: "sensor_msgs__msg__LaserScan", unit: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """(M,) beams that seem to have hit something, and their ranges in metres."""
    with np.errstate(invalid="ignore"):  # damaged bytes may contain signalling NaN
        ranges = np.asarray(message.ranges, dtype=np.float64) * unit
    low, high = limits(message, unit)
    beams = np.flatnonzero((ranges > max(low, 0.0)) & (ranges < (high if high > 0 else np.inf)))
    return beams, ranges[beams]


def limits(message: "sensor_msgs__msg__LaserScan", unit: float) -> tuple[float, float]:
    """``range_min`` and ``range_max`` in metres; they may be stated in metres when the ranges are not."""
    scale = unit if message.range_max > _ABSURD_RANGE else 1.0
    return message.range_min * scale, message.range_max * scale
