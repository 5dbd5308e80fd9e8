"""The beginning of a bag is read for what it proves about its sensors, before all of it is read."""

from collections.abc import Callable

from racecar.maps.errors import UserError
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.runs.foreseen_findings import foreseen_findings
from racecar.pipelines.runs.learned_corrections import KnownSensors, learned_corrections
from racecar.pipelines.runs.progress import progress_bar
from racecar.sensors.findings import Finding
from racecar.sensors.self_calibration.self_calibration import SelfCalibration, SelfCalibrator

_MOST_MESSAGES = 20_000
"""Of the beginning, so that of a recording that stands still some minutes are read and not all of it."""


def calibrate(reader: BagReader, *, quiet: bool) -> list[Finding]:
    """Let the reader correct what the beginning of its bag proves to be wrong, and say so in its findings.

    Returned is what whoever maps the bag, or localizes on it, will find out by himself.
    """
    known = KnownSensors(
        scan_topic=reader.scan_topic,
        odom_topic=reader.odom_topic,
        base_from_laser=reader.base_from_laser,
        place_source=reader.base_from_laser_source,
        header_offsets=reader.header_offsets,
        is_upside_down=reader.laser_is_upside_down,
        is_alone=len(reader.scan_topics) == 1,
    )
    with progress_bar("Looking at the sensors", _MOST_MESSAGES, quiet=quiet) as advance_to:
        calibrator = SelfCalibrator(asks_wheels=known.odom_topic is not None)
        learned = _learn(reader, calibrator, known, advance_to)
    corrections = learned_corrections(learned, known)
    reader.correct(corrections)
    return foreseen_findings(learned, corrections)


def _learn(
    reader: BagReader, calibrator: SelfCalibrator, known: KnownSensors, advance_to: Callable[[float], None]
) -> SelfCalibration:
    try:
        for number, message in enumerate(reader, start=1):
            feed(message, calibrator)
            if not calibrator.is_done and number < _MOST_MESSAGES:
                advance_to(number)
                continue
            learned = calibrator.estimate(known.recorded_lag)
            if number >= _MOST_MESSAGES or not calibrator.wants_more(learned):
                return learned
    except UserError:  # not one scan is usable, which whoever reads the bag next will say
        return SelfCalibration()
    return calibrator.estimate(known.recorded_lag)
