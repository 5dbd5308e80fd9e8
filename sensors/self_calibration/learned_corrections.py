"""What is made of what a recording proves about its sensors: corrections, and findings that say so."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.corrections import Corrections
from racecar.sensors.findings import Finding, in_words
from racecar.sensors.motion.turn_fusion import MAX_SCALE_ERROR
from racecar.sensors.self_calibration.bearing_scale import BearingScale
from racecar.sensors.self_calibration.mount import MotionReading, MountEstimate
from racecar.sensors.self_calibration.odometry_fault import OdometryFault
from racecar.sensors.self_calibration.self_calibration import SelfCalibration
from racecar.sensors.self_calibration.sweep_order import SweepOrder
from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG, TurnAgreement
from racecar.sensors.self_calibration.wheel_track import WheelSigns

_FAR_CLOCKS = 1_000_000_000
"""Nanoseconds between the stamps of scans and odometry recorded together, above which their clocks differ and
not their delays: filters and buses hold back less than a second. Chosen by judgement."""
_HALF_A_TURN = 0.75 * np.pi
"""Radians above which a laser seems to be turned by half a turn, as wheels that run backwards also make it
look. Chosen by judgement: halfway from a right angle."""
_ANOTHER_ORIGIN = 86_400_000_000_000
"""Nanoseconds, a day, since no clock that was ever set is off by more."""
_GYRO_LAG = 60_000_000
"""Nanoseconds that a gyroscope and scans may be apart: skewed sweeps alone show 0.035 s, measured on a
simulated drive."""
_FOOT = 0.3048
"""Metres, by definition."""
_OF_A_FOOT = 0.02
"""Share by which a ratio may miss it: wheels of a known radius are right to 2 %. Chosen by judgement."""
_NOT_TOLD = ("assumed identity", "base frame")
"""Sources of a laser's place that are no more than an assumption."""


@dataclass(frozen=True, eq=False)
class KnownSensors:
    """What the recording itself says."""

    scan_topic: str
    odom_topic: str | None
    base_from_laser: Pose
    """(3,)"""
    place_source: str
    """Where that is known from."""
    header_offsets: tuple[int | None, int | None] = (None, None)
    """Nanoseconds that stamps of scans and of odometry are ahead of when they were recorded."""
    is_upside_down: bool = False
    """Whether the laser hangs upside down by its place."""
    is_alone: bool = True
    """Whether no further laser is used, whose place may be as wrong as this one's."""
    rival_place: Pose | None = None
    """(3,) another place that the recording states."""

    @property
    def is_place_told(self) -> bool:
        """Whether the laser's place is given or published."""
        return self.place_source not in _NOT_TOLD

    @property
    def recorded_lag(self) -> int:
        """Nanoseconds by which odometry is stamped later than scans, as far as the times of recording show
        that clocks differ."""
        scans, odometry = self.header_offsets
        lag = 0 if scans is None or odometry is None else odometry - scans
        return lag if abs(lag) > _FAR_CLOCKS else 0


def learned_corrections(learned: SelfCalibration, known: KnownSensors) -> Corrections:
    """The corrections that the recording needs, from the evidence in its data and from what it states."""
    made = _Made(known)
    if learned.reading is not None:
        made.choose_place(learned.reading.mount)
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

    def choose_place(self, mount: MountEstimate) -> None:
        """Use the other stated place if the motions prove that one."""
        known, rival = self._known, self._known.rival_place
        if rival is None or not mount.proves(rival, known.base_from_laser):
            return
        self._known = replace(known, base_from_laser=rival)
        self.changes["base_from_laser"] = rival
        self._find(
            "place_of_two",
            topic=known.scan_topic,
            other=in_words(known.base_from_laser),
            place=in_words(rival),
            given=_numbers(rival),
        )

    def reverse_beams(self) -> None:
        self.changes["beams_are_reversed"] = True
        self._find("beams_reversed", topic=self._known.scan_topic)

    def scale_bearings(self, scale: BearingScale) -> None:
        """Read the angles otherwise where walls and turns show both; else say what one of them shows."""
        if scale.is_certain:
            self.changes["bearing_factor"] = scale.factor
        self._find(
            "bearings_scaled" if scale.is_certain else "bearings_doubtful",
            spoils_map=not scale.is_certain,
            topic=self._known.scan_topic,
            factor=scale.factor,
        )

    def doubt_turns(self, learned: SelfCalibration) -> None:
        """Say so where odometry that is used turns far more or less than the scans."""
        turns, is_used = learned.turns, self.changes.get("uses_odometry", True)
        if turns is None or not is_used or learned.bearing_scale is not None:
            return
        if turns.is_scaled:
            self._find(
                "turns_disagree", spoils_map=True, ratio=abs(turns.ratio), topic=self._known.odom_topic
            )

    def shift_gyro(self, turns: TurnAgreement | None) -> None:
        """Let the gyroscope's stamps agree with the scans', as turns are taken from it moment by moment."""
        lag = 0 if turns is None else turns.lag - int(self.changes.get("scan_shift", 0))
        if abs(lag) < _GYRO_LAG:
            return
        self.changes["yaw_rate_shift"] = -lag
        self._find("imu_lags", milliseconds=abs(lag) / 1e6, side="behind" if lag > 0 else "ahead of")

    def leave_out_odometry(self, fault: OdometryFault, gyro: TurnAgreement | None) -> None:
        """Unless only its turns are missing, and a gyroscope has those."""
        has_turns = gyro is not None and not gyro.is_inverted and not gyro.is_scaled
        numbers: dict[str, Any] = {"topic": self._known.odom_topic, "fault": fault.value}
        if fault == OdometryFault.WITHOUT_TURNS and has_turns:
            self._find("odometry_turns_from_imu", **numbers)
        else:
            self._leave_out(f"odometry_{fault.name.lower()}", **numbers)

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
        numbers: dict[str, Any] = {
            "topic": self._known.odom_topic,
            "other": self._known.scan_topic,
            "evidence": evidence,
            "done": done,
        }
        if abs(lag) < _ANOTHER_ORIGIN:
            side = "ahead of" if lag > 0 else "behind"
            self._find("clocks_apart", seconds=abs(lag) * 1e-9, side=side, **numbers)
        else:
            self._find("clocks_of_other_origins", **numbers)

    def check_straight_motion(self, reading: MotionReading | None) -> None:
        """Check that a robot that hardly turned moved in the direction that the laser's place implies."""
        if reading is not None and self._known.is_place_told and reading.mount.is_clear:
            self._check_yaw(reading.mount)

    def read_motion(self, learned: SelfCalibration, *, is_inverted: bool) -> None:
        """Correct or report whatever makes scans and wheels disagree about the motion."""
        reading = learned.reading
        if reading is not None and reading.wheel_signs == WheelSigns.PATH_MIRRORED:
            self._leave_out("odometry_mirrored", topic=self._known.odom_topic)
        elif is_inverted and self._hangs_otherwise(learned):
            self._hang_otherwise()
        elif reading is None or not reading.mount.is_certain:
            if is_inverted:
                self._leave_out("turns_inverted")
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
        are_feet = abs(ratio / _FOOT - 1.0) < _OF_A_FOOT
        self._find(
            "distances_disagree",
            spoils_map=are_feet,
            topic=self._known.odom_topic,
            scans=self._known.scan_topic,
            ratio=ratio,
            in_feet=", as they would be in feet," if are_feet else ",",
            size=1.0 / ratio,
        )

    def _change_signs(self, signs: WheelSigns) -> None:
        self.changes["odometry_factors"] = tuple(signs.factors.tolist())
        what, why = "y and yaw are", f"since the laser's place is known ({self._known.place_source})"
        if signs == WheelSigns.YAW_INVERTED:
            what, why = "yaw is", "since its own path shows it too"
        self._find("signs_changed", topic=self._known.odom_topic, what=what, why=why)

    def _hangs_otherwise(self, learned: SelfCalibration) -> bool:
        """Whether a gyroscope, too, turns against the scans, which contradicts a published mount; a
        given place decides. Wheels that contradict themselves are no evidence."""
        reading, gyro = learned.reading, learned.gyro_turns
        if not self._known.is_place_told or self._known.place_source == "given":
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
            "laser_hangs_otherwise",
            right=right,
            source=known.place_source,
            told=told,
            read=_numbers(known.base_from_laser, roll),
            as_told=_numbers(known.base_from_laser, np.pi - roll),
        )

    def _hang_upside_down(self, place: Pose) -> None:
        self.changes |= {"is_upside_down": True, "base_from_laser": place}
        self._find(
            "laser_upside_down",
            place=in_words(place),
            hanging=_numbers(place, np.pi),
            upright=_numbers(place * [1.0, -1.0, -1.0]),
        )

    def _check_yaw(self, mount: MountEstimate) -> None:
        known = self._known
        error = mount.yaw_error(known.base_from_laser)
        if error == 0.0:
            return
        if not known.is_place_told:
            place = mount.as_mounted()
            self.changes["base_from_laser"] = place
            self._find("place_learned", topic=known.scan_topic, place=in_words(place), given=_numbers(place))
        elif self._yields(mount, error):
            place = np.append(known.base_from_laser[:2], mount.base_from_laser[2])
            self.changes["base_from_laser"] = place
            self._find("place_turned", **self._told_and_shown(place))
        else:
            self._leave_out("place_contradicted", **self._told_and_shown(mount.as_mounted()))

    def _yields(self, mount: MountEstimate, error: float) -> bool:
        """Whether a published place has a yaw ``error``, rather than the wheels; a given place decides."""
        is_given = self._known.place_source == "given"
        return mount.cannot_slip and abs(error) < _HALF_A_TURN and self._known.is_alone and not is_given

    def _told_and_shown(self, place: Pose) -> dict[str, Any]:
        """The numbers of a finding: the laser's given yaw and the place (3,) that the motions show."""
        known = self._known
        return {
            "told": np.degrees(known.base_from_laser[2]),
            "source": known.place_source,
            "shown": np.degrees(place[2]),
            "place": _numbers(place, np.pi if known.is_upside_down else 0.0),
        }

    def _leave_out(self, name: str, **numbers: Any) -> None:
        self.changes["uses_odometry"] = False
        self._find(name, **numbers)

    def _find(self, name: str, *, spoils_map: bool = False, **numbers: Any) -> None:
        self.findings.append(Finding(name, spoils_map=spoils_map, **numbers))


def _numbers(place: Pose, roll: float = 0.0) -> str:
    numbers = [*(place + 0.0).tolist(), *([roll] if roll else [])]
    return " ".join(f"{number:.4g}" for number in numbers)
