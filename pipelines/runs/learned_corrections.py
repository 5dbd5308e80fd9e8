"""What is made of what a recording proves about its sensors: corrections, and findings that say so."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from racecar.mapping.self_calibration.bearing_scale import BearingScale
from racecar.mapping.self_calibration.mount import MotionReading, MountEstimate
from racecar.mapping.self_calibration.odometry_fault import OdometryFault
from racecar.mapping.self_calibration.self_calibration import SelfCalibration
from racecar.mapping.self_calibration.sweep_order import SweepOrder
from racecar.mapping.self_calibration.turn_agreement import RIGHT_FACTOR, USUAL_LAG, TurnAgreement
from racecar.mapping.self_calibration.wheel_track import WheelSigns
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.turn_fusion import MAX_SCALE_ERROR
from racecar.pipelines.bags.corrections import Corrections
from racecar.pipelines.bags.findings import BY_SCANS_ALONE, ONE_CLOCK, Finding

_FAR_CLOCKS = 1_000_000_000
"""Nanoseconds between the stamps of scans and odometry that were recorded together, from which their clocks
differ and not their delays, since filters and buses hold back less than a second; by judgement."""
_ANOTHER_ORIGIN = 86_400_000_000_000
"""Nanoseconds, a day, since no clock that was ever set is off by more."""
_GYRO_LAG = 60_000_000
"""Nanoseconds that a gyroscope and scans may be apart: skewed sweeps alone show 0.035 s, measured on a
simulated drive."""
_FOOT = 0.3048
"""Metres, by definition."""
_OF_A_FOOT = 0.02
"""Share by which a ratio may miss it, since wheels of a known radius are right to 2 %; by judgement."""
_NOT_TOLD = ("assumed identity", "base frame")
"""Sources of a laser's place that are no more than an assumption."""

_REMEDIES = {
    OdometryFault.STUCK: "If the robot was carried, no action is needed; otherwise find out why its driver "
    "sends no motion, or name another topic with --odom-topic.",
    OdometryFault.WITHOUT_DISTANCE: "If the robot was carried, no action is needed; otherwise make its node "
    "integrate the speed of the wheels too, in metres.",
    OdometryFault.WITHOUT_TURNS: "Make its node integrate steering angle or gyroscope, or record an IMU.",
    OdometryFault.IMPOSSIBLE: "Make sure that its node gives metres and radians, and that only one "
    "publishes it.",
}


@dataclass(frozen=True, eq=False)
class KnownSensors:
    """What the recording itself says."""

    scan_topic: str
    odom_topic: str | None
    base_from_laser: Pose
    """(3,)"""
    place_source: str
    """Where that is known from."""
    header_offsets: tuple[int | None, int | None]
    """Nanoseconds that stamps of scans and of odometry are ahead of when they were recorded."""
    is_upside_down: bool = False
    """Whether the laser hangs upside down by its place."""

    @property
    def is_place_told(self) -> bool:
        """Whether somebody said where the laser sits."""
        return self.place_source not in _NOT_TOLD

    @property
    def recorded_lag(self) -> int:
        """Nanoseconds by which odometry is stamped later than scans, as far as the times of recording show
        that clocks differ."""
        scans, odometry = self.header_offsets
        lag = 0 if scans is None or odometry is None else odometry - scans
        return lag if abs(lag) > _FAR_CLOCKS else 0


def learned_corrections(learned: SelfCalibration, known: KnownSensors) -> Corrections:
    """How the recording is to be read, by what it proves about itself beside what it says."""
    made = _Made(known)
    if learned.bearing_scale is not None:
        made.scale_bearings(learned.bearing_scale)
    if learned.sweep_order == SweepOrder.REVERSED:
        made.reverse_beams()
    if learned.odometry_fault is not None:
        made.leave_out_odometry(learned.odometry_fault, learned.gyro_turns)
    elif learned.turns is not None:
        made.shift_clock(learned.turns.lag, "as the turns show")
        made.read_motion(learned, is_inverted=learned.turns.is_inverted)
    else:
        made.shift_clock(known.recorded_lag, "by when they were recorded")
        made.check_straight_motion(learned.reading)
    made.check_distances(learned.reading)
    made.doubt_turns(learned)
    made.shift_gyro(learned.gyro_turns)
    return Corrections(**made.changes, findings=tuple(made.findings))


class _Made:
    """The corrections made so far."""

    def __init__(self, known: KnownSensors) -> None:
        self._known = known
        self.changes: dict[str, Any] = {}
        self.findings: list[Finding] = []

    def reverse_beams(self) -> None:
        self.changes["beams_are_reversed"] = True
        self._find(
            f"The beams of {self._known.scan_topic} were measured in the opposite order of time to the one "
            "recorded, as the turns show: they are read so.",
            "No action is needed: drivers of the RPLIDAR kind turn the ranges round and leave time_increment "
            "positive.",
        )

    def scale_bearings(self, scale: BearingScale) -> None:
        """Read the angles otherwise where walls and turns show both; else say what one of them shows."""
        topic, factor = self._known.scan_topic, scale.factor
        what = f"The beams of {topic} lie over {factor:.2f} times the angle that is stated"
        remedy = (
            "Correct angle_min, angle_max and angle_increment in the driver: they must span what it sees."
        )
        if scale.is_certain:
            self.changes["bearing_factor"] = factor
            self._find(f"{what}, as straight walls and the turns show: they are read so.", remedy)
        else:
            self._find(f"{what}, as far as the scans show: they are read as stated.", remedy, spoils_map=True)

    def doubt_turns(self, learned: SelfCalibration) -> None:
        """Say so where odometry that is used turns far more or less than the scans."""
        turns, is_used = learned.turns, self.changes.get("uses_odometry", True)
        if turns is None or not is_used or learned.bearing_scale is not None:
            return
        if turns.is_beyond(RIGHT_FACTOR):
            self._find(
                f"The scans turn {abs(turns.ratio):.2f} times as far as the odometry on "
                f"{self._known.odom_topic}: the angles of one of them are wrong.",
                "Correct angle_increment in the laser's driver, or wheelbase, track or steering gain in the "
                "odometry's node.",
                spoils_map=True,
            )

    def shift_gyro(self, turns: TurnAgreement | None) -> None:
        """Let the gyroscope's stamps agree with the scans', as turns are taken from it moment by moment."""
        lag = 0 if turns is None else turns.lag - int(self.changes.get("scan_shift", 0))
        if abs(lag) < _GYRO_LAG:
            return
        self.changes["yaw_rate_shift"] = -lag
        where = "behind" if lag > 0 else "ahead of"
        what = f"By its stamps the IMU is {abs(lag) / 1e6:.0f} ms {where} the scans, as the turns show"
        self._find(f"{what}: they are shifted.", ONE_CLOCK)

    def leave_out_odometry(self, fault: OdometryFault, gyro: TurnAgreement | None) -> None:
        """Unless only its turns are missing, and a gyroscope has those."""
        has_turns = gyro is not None and not gyro.is_inverted and not gyro.is_beyond(RIGHT_FACTOR)
        what = f"The odometry on {self._known.odom_topic} {fault.value}"
        if fault == OdometryFault.WITHOUT_TURNS and has_turns:
            self._find(f"{what}: turns are taken from the IMU.", "Make the odometry's node turn too.")
            return
        self._leave_out(f"{what}: it is not used", _REMEDIES[fault])

    def shift_clock(self, lag: int, evidence: str) -> None:
        """Odometry is stamped ``lag`` nanoseconds later than the scans of the same moment."""
        if abs(lag) <= USUAL_LAG:
            return  # mapper and localizer bear it
        scans, odometry = self._known.header_offsets
        if scans is not None and odometry is not None and abs(scans) > abs(odometry) + 0.5 * abs(lag):
            self.changes["scan_shift"] = lag
            done = "the scans' stamps are shifted, since the odometry's agree with when it was recorded"
        else:
            self.changes["odometry_shift"] = -lag
            done = "the odometry's stamps are shifted"
        topic, other = self._known.odom_topic, self._known.scan_topic
        ahead = "ahead of" if lag > 0 else "behind"
        apart = (
            f"The clock of {topic} is {abs(lag) * 1e-9:.2f} s {ahead} that of {other}"
            if abs(lag) < _ANOTHER_ORIGIN
            else f"The clocks of {topic} and {other} count from different origins, such as 1970 and power-on"
        )
        self._find(
            f"{apart}, {evidence}: {done}.",
            ONE_CLOCK,
        )

    def check_straight_motion(self, reading: MotionReading | None) -> None:
        """Of a robot that hardly turned: whether it went where the laser's place, if told, has it look."""
        if reading is not None and self._known.is_place_told and reading.mount.is_clear:
            self._check_yaw(reading.mount)

    def read_motion(self, learned: SelfCalibration, *, is_inverted: bool) -> None:
        """Mend, or name, what makes scans and wheels report different motions."""
        reading = learned.reading
        if reading is not None and reading.wheel_signs == WheelSigns.PATH_MIRRORED:
            topic = self._known.odom_topic
            self._leave_out(
                f"The odometry on {topic} does not go where its own yaw looks: it is not used",
                "Make sure that its node does not exchange x and y, or change the sign of one of them (REP "
                "103).",
            )
        elif is_inverted and self._hangs_otherwise(learned):
            self._hang_otherwise()
        elif reading is None or not reading.mount.is_certain:
            if is_inverted:
                self._leave_out(
                    "The scans turn left where the odometry turns right, and nothing shows which is wrong: "
                    "the odometry is not used",
                    "Correct the sign of the odometry's yaw; or, if the laser hangs upside down, give its "
                    "place: --laser-pose 'X Y YAW 3.1416'.",
                )
        elif reading.wheel_signs == WheelSigns.MIRRORED and not self._known.is_place_told:
            self._hang_upside_down(reading.mount.as_mounted() * [1.0, -1.0, -1.0] + 0.0)
        else:
            if reading.wheel_signs != WheelSigns.AS_RECORDED:
                self._change_signs(reading.wheel_signs)
            self._check_yaw(reading.mount)

    def check_distances(self, reading: MotionReading | None) -> None:
        """Let the wheels go as far as the scans where one of the two is surely wrong."""
        is_used = self.changes.get("uses_odometry", True)
        if reading is None or not reading.mount.has_wrong_path or not is_used:
            return
        ratio = reading.mount.path_ratio
        x, y, yaw = self.changes.get("odometry_factors", (1.0, 1.0, 1.0))
        self.changes["odometry_factors"] = (x / ratio, y / ratio, yaw)
        scans = self._known.scan_topic
        are_feet = abs(ratio / _FOOT - 1.0) < _OF_A_FOOT
        likely = ", as they would be in feet," if are_feet else ","
        self._find(
            f"The odometry on {self._known.odom_topic} reports {ratio:.0%} of the distance that the scans "
            f"show: it is corrected to that. If the ranges of {scans} are wrong instead{likely} the map is "
            f"{1.0 / ratio:.2f} times its true size.",
            "Measure a wall of the map. If it is right, correct wheel radius, gear or the gain from motor to "
            f"speed in the odometry's node; if not, the unit of the ranges on {scans}, which are metres.",
            spoils_map=are_feet,
        )

    def _change_signs(self, signs: WheelSigns) -> None:
        self.changes["odometry_factors"] = tuple(signs.factors.tolist())
        what, why = "y and yaw are", f"since the laser's place is known ({self._known.place_source})"
        if signs == WheelSigns.YAW_INVERTED:
            what, why = "yaw is", "since its own path shows it too"
        self._find(
            f"The odometry on {self._known.odom_topic} turns right where the scans turn left: its {what} "
            f"read with the other sign, {why}.",
            "Correct the sign in the odometry's node: counter-clockwise is positive (REP 103).",
        )

    def _hangs_otherwise(self, learned: SelfCalibration) -> bool:
        """Whether a gyroscope, too, turns against the scans, which speaks against a transform that tells
        the laser's place; a flag decides. Wheels that contradict themselves are no witness."""
        reading, gyro = learned.reading, learned.gyro_turns
        if not self._known.is_place_told or self._known.place_source == "flag":
            return False
        if reading is not None and reading.wheel_signs == WheelSigns.YAW_INVERTED:
            return False
        return gyro is not None and not gyro.differs(-1.0, MAX_SCALE_ERROR)

    def _hang_otherwise(self) -> None:
        self.changes["is_upside_down"] = True
        known = self._known
        told, right = ("upside down", "upright") if known.is_upside_down else ("upright", "upside down")
        roll = 0.0 if known.is_upside_down else np.pi
        self._find(
            "Odometry and gyroscope turn left where the scans turn right: the laser is read as hanging "
            f"{right}, although its transform ({known.place_source}) has it {told}. If both turn the wrong "
            "way, as wheels that take their turns from the gyroscope do, the map is its mirror image.",
            f"Correct the roll in the laser's transform, or give {_as_option(known.base_from_laser, roll)}; "
            f"if the transform is right, {_as_option(known.base_from_laser, np.pi - roll)}.",
        )

    def _hang_upside_down(self, place: Pose) -> None:
        self.changes |= {"is_upside_down": True, "base_from_laser": place}
        self._find(
            "The scans turn left where the odometry turns right: the laser is taken to hang upside down, at "
            f"{_in_words(place)}. If the odometry's sign is wrong instead, the map is its mirror image.",
            f"Give the laser's place, which decides it: --laser-pose {_as_flag(place, np.pi)} if it hangs "
            f"upside down, --laser-pose {_as_flag(place * [1.0, -1.0, -1.0])} if not.",
        )

    def _check_yaw(self, mount: MountEstimate) -> None:
        known = self._known
        error = mount.yaw_error(known.base_from_laser)
        if error == 0.0:
            return
        place = mount.as_mounted()
        is_transform = known.is_place_told and known.place_source != "flag"
        if is_transform and mount.drives_ahead and abs(error) < 0.5 * np.pi:
            place = np.append(known.base_from_laser[:2], mount.base_from_laser[2])
            self.changes["base_from_laser"] = place
            self._find(
                f"The laser looks {_degrees(known.base_from_laser)} to the left by its transform "
                f"({known.place_source}), but {_degrees(place)} by the scans, since the odometry drives "
                "along the axis of the robot: so it is read.",
                f"Correct the transform, or give --laser-pose {_as_flag(place)}.",
            )
            return
        if known.is_place_told:
            self._leave_out(
                f"The laser looks {_degrees(known.base_from_laser)} to the left by its place "
                f"({known.place_source}), but {_degrees(place)} by the directions of travel of scans and "
                "odometry: the place is believed, the odometry is not used",
                f"Correct the one that is wrong; if it is the place, give --laser-pose {_as_flag(place)}.",
            )
            return
        self.changes["base_from_laser"] = place
        self._find(
            f"Nothing says where the laser of {known.scan_topic} sits on the car: it is taken to be at "
            f"{_in_words(place)}, as scans and odometry show.",
            f"Measure it and give it with --laser-pose, as {_as_flag(place)}, or record /tf_static.",
        )

    def _leave_out(self, what: str, remedy: str) -> None:
        self.changes["uses_odometry"] = False
        self._find(f"{what}, and {BY_SCANS_ALONE}.", remedy)

    def _find(self, what: str, remedy: str, *, spoils_map: bool = False) -> None:
        self.findings.append(Finding(what, remedy, spoils_map))


def _in_words(place: Pose) -> str:
    return f"x {place[0]:.2f} m, y {place[1]:.2f} m, yaw {_degrees(place)}"


def _degrees(place: Pose) -> str:
    return f"{np.degrees(place[2]):.0f}°"


def _as_option(place: Pose, roll: float) -> str:
    return f"--laser-pose {_as_flag(place, roll)}"


def _as_flag(place: Pose, roll: float = 0.0) -> str:
    numbers = [*(place + 0.0).tolist(), *([roll] if roll else [])]
    return "'" + " ".join(f"{number:.4g}" for number in numbers) + "'"
