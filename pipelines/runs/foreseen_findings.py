"""What a mapper would find out about clocks and gyroscope while it maps, for those who only check."""

from racecar.sensors.corrections import Corrections
from racecar.sensors.findings import Finding
from racecar.sensors.motion.lag import NOTICEABLE
from racecar.sensors.motion.turn_fusion import MAX_SCALE_ERROR, TurnModel
from racecar.sensors.self_calibration.self_calibration import SelfCalibration
from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG


def foreseen_findings(learned: SelfCalibration, made: Corrections) -> list[Finding]:
    """Of what was learned, that which is not corrected beforehand since mapper and localizer bear it."""
    return [*_of_lag(learned, made), *_of_gyro(learned, made)]


def _of_lag(learned: SelfCalibration, made: Corrections) -> list[Finding]:
    lag = 0 if learned.turns is None or not made.uses_odometry else learned.turns.lag
    if not NOTICEABLE <= abs(lag) <= USUAL_LAG:
        return []
    side = "behind" if lag > 0 else "ahead of"
    return [Finding("odometry_lags", milliseconds=abs(lag) / 1e6, side=side)]


def _of_gyro(learned: SelfCalibration, made: Corrections) -> list[Finding]:
    """By the same measure as the mapper's, which does not use such a gyroscope."""
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
