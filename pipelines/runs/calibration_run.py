"""Read the beginning of a bag to calibrate its sensors before the whole bag is read."""

from collections.abc import Callable

from racecar.maps.errors import UserError
from racecar.pipelines.bags.check import BagCheck, check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.runs.run_context import RunContext
from racecar.sensors.corrections import Corrections
from racecar.sensors.findings import Finding
from racecar.sensors.motion.lag import NOTICEABLE, lag_finding
from racecar.sensors.motion.turn_fusion import MAX_SCALE_ERROR, TurnModel
from racecar.sensors.self_calibration.learned_corrections import KnownSensors, learned_corrections
from racecar.sensors.self_calibration.odometry_fault import OdometryFault
from racecar.sensors.self_calibration.self_calibration import MOST, SelfCalibration, SelfCalibrator
from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG


def calibrate(reader: BagReader, context: RunContext) -> list[Finding]:
    """Correct the sensor faults that the beginning of a bag proves, and add them to the findings of its
    reader.

    Returns the findings that mapping or localization will make itself; both tolerate these uncorrected.
    """
    known = KnownSensors(
        scan_topic=reader.scan_topic,
        odom_topic=reader.odom_topic,
        base_from_laser=reader.base_from_laser,
        place_source=reader.base_from_laser_source,
        rival_place=reader.rival_place,
        header_offsets=reader.header_offsets,
        is_upside_down=reader.laser_is_upside_down,
        is_alone=len(reader.scan_topics) == 1,
    )
    with context.progress("Looking at the sensors", MOST) as advance_to:
        calibrator = SelfCalibrator(asks_wheels=known.odom_topic is not None)
        learned = _learn(reader, calibrator, known, advance_to)
    if learned.turns is not None and learned.turns.is_inverted and reader.reads_from_the_other_end():
        return calibrate(reader, context)
    if learned.odometry_fault == OdometryFault.RESETS and reader.reads_speeds():
        return calibrate(reader, context)
    corrections = learned_corrections(learned, known)
    reader.correct(corrections)
    return [*_foreseen_lag(learned, corrections), *_foreseen_gyro(learned, corrections)]


def check_reader(reader: BagReader, context: RunContext) -> BagCheck:
    """Contents of an open bag, its faults, and the findings that mapping will make.

    The bag is read once, and its beginning twice. Raises UserError when no scan is usable.
    """
    foreseen = calibrate(reader, context)
    with context.progress("Reading", reader.message_count) as advance_to:
        checked = check_bag(reader, advance_to)
    checked.findings.extend(foreseen)
    return checked


def _learn(
    reader: BagReader, calibrator: SelfCalibrator, known: KnownSensors, advance_to: Callable[[float], None]
) -> SelfCalibration:
    try:
        for number, message in enumerate(reader, start=1):
            if (learned := calibrator.learn(message, known.recorded_lag)) is not None:
                return learned
            advance_to(number)
    except UserError:  # no scan is usable, which the next reading reports
        return SelfCalibration()
    return calibrator.estimate(known.recorded_lag)


def _foreseen_lag(learned: SelfCalibration, made: Corrections) -> list[Finding]:
    lag = 0 if learned.turns is None or not made.uses_odometry else learned.turns.lag
    if not NOTICEABLE <= abs(lag) <= USUAL_LAG:
        return []
    return [lag_finding(lag)]


def _foreseen_gyro(learned: SelfCalibration, made: Corrections) -> list[Finding]:
    """Apply the mapper's own criterion; it does not use such a gyroscope."""
    turns = learned.gyro_turns
    is_known = learned.bearing_scale is None or learned.bearing_scale.is_certain
    if turns is None or not is_known:
        return []
    scale = -turns.ratio if made.is_upside_down else turns.ratio
    if abs(scale - 1.0) < MAX_SCALE_ERROR + 3.0 * turns.sigma:
        return []
    wheels = learned.turns
    are_alike = wheels is not None and abs(wheels.ratio / turns.ratio - 1.0) < MAX_SCALE_ERROR
    model = TurnModel(is_contradicted=True, scale=scale, agrees_with_wheels=are_alike)
    assert model.contradiction is not None
    contradiction = model.contradiction.replace("was not used", "is not used")
    return [Finding("gyroscope_contradicts", contradiction=contradiction, remedy=model.remedy)]
