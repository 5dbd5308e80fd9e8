"""What the beginning of a recording proves about its sensors: all estimators over one track of its scans."""

from dataclasses import dataclass, replace

from racecar.mapping.self_calibration.bearing_scale import BearingScale, bearing_scale
from racecar.mapping.self_calibration.distance_ratio import LEAST, DistanceRatio, distance_ratio
from racecar.mapping.self_calibration.mount import MIN_YAW_ERROR, MotionReading, read_motion
from racecar.mapping.self_calibration.odometry_fault import OdometryFault, fault_in, is_impossible
from racecar.mapping.self_calibration.scan_track import ScanTrack, ScanTracker, track_of
from racecar.mapping.self_calibration.sweep_order import SweepOrder, estimate_sweep_order, has_sweep_times
from racecar.mapping.self_calibration.turn_agreement import (
    MAX_LAG,
    USUAL_LAG,
    TurnAgreement,
    turn_agreement,
)
from racecar.mapping.self_calibration.turn_ratio import TurnRatio, turn_ratio
from racecar.mapping.self_calibration.wall_straightness import wall_straightness
from racecar.mapping.self_calibration.wheel_track import WheelTrack, motion_pairs, windows_of
from racecar.maps.geometry.se2 import wrap_angle
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scaled_bearings import with_bearings_scaled
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.yaw_rate import YawRate

_MIN_SCANS = 60
"""Scans that are followed at least; by judgement: some seconds."""
_MAX_SCANS = 2000
"""Scans that are followed at most, so that it takes seconds; by judgement: two minutes of a fast laser."""
_ENOUGH_TURN, _ENOUGH_DISTANCE = 3.0, 3.0
"""Radians, to and fro, and metres of path after which they may suffice, if nothing speaks against the
recording; by judgement: half of what its faults need."""
_MAX_LEVEL = 8
"""By what factor both may grow while something is open; by judgement: a minute or two."""


@dataclass(frozen=True, eq=False)
class SelfCalibration:
    """What was proved; None or unknown where the recording does not tell."""

    sweep_order: SweepOrder = SweepOrder.UNKNOWN
    turns: TurnAgreement | None = None
    """How the wheels' turns agree with the scans'."""
    reading: MotionReading | None = None
    """Where the laser sits, and which signs are wrong."""
    odometry_fault: OdometryFault | None = None
    distances: DistanceRatio | None = None
    """Of the wheels to the scans."""
    gyro_has_turns: bool = False
    """Of odometry without turns: whether a gyroscope has them, as the scans show."""
    bearing_scale: BearingScale | None = None
    """Of scans whose beams lie over another angle than they state."""
    wheel_turns: TurnRatio | None = None
    """Of the scans' turns to those of the wheels, with the beams where they are."""
    gyro_turns: TurnRatio | None = None
    """The same of the gyroscope."""


class SelfCalibrator:
    """Takes scans and odometry of the beginning of a recording, in the order of time, until they suffice."""

    def __init__(self, *, asks_wheels: bool = True, max_lag: float = MAX_LAG) -> None:
        """Without ``asks_wheels`` it is asked for the order of the beams alone. Clocks that are not expected
        to be farther apart are asked about lags up to ``max_lag`` seconds."""
        self._max_lag = max_lag
        self._asks_order, self._asks_wheels = True, asks_wheels
        self._tracker = ScanTracker()
        self._odometry: list[Odometry] = []
        self._yaw_rates: list[YawRate] = []
        self._first: Scan | None = None
        self._level = 1

    def add_odometry(self, odometry: Odometry) -> None:
        """Take a sample of wheel odometry."""
        if self._asks_wheels:
            self._odometry.append(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take a sample of the gyroscope: asked for its scale, its lag, and turns that wheels lack."""
        self._yaw_rates.append(yaw_rate)

    def add_scan(self, scan: Scan) -> None:
        """Take a scan; of several lasers only the first is followed."""
        if self._first is None:
            self._first = scan
            self._asks_order = self._asks_order and has_sweep_times(scan)
        if scan.laser == self._first.laser:
            self._tracker.add(scan)

    @property
    def is_done(self) -> bool:
        """Whether the scans so far are enough, or more would not help."""
        tracker = self._tracker
        if self._first is not None and not (self._asks_order or self._asks_wheels or self._yaw_rates):
            return len(tracker) >= _MIN_SCANS  # which show whether walls are straight
        return len(tracker) >= _MAX_SCANS or (
            len(tracker) >= _MIN_SCANS
            and tracker.turned > self._level * _ENOUGH_TURN
            and tracker.distance > self._level * _ENOUGH_DISTANCE
        )

    def wants_more(self, learned: SelfCalibration) -> bool:
        """Whether more of the recording should be looked at, since what is ``learned`` leaves something
        open, or the little that there was speaks against the recording."""
        is_first, self._level = self._level == 1, 2 * self._level
        is_open = self._asks_order and learned.sweep_order == SweepOrder.UNKNOWN
        if self._asks_wheels and learned.odometry_fault is None:
            is_open = is_open or learned.turns is None or (is_first and not self._is_clear(learned))
        is_open = is_open or (is_first and bool(self._yaw_rates) and learned.gyro_turns is None)
        return is_open and len(self._tracker) < _MAX_SCANS and self._level <= _MAX_LEVEL

    def _is_clear(self, learned: SelfCalibration) -> bool:
        """Whether the wheels agree with the scans, as far as such few motions can show."""
        turns, reading = learned.turns, learned.reading
        if turns is None or turns.is_inverted or abs(turns.lag) > USUAL_LAG:
            return False
        if reading is None or self._first is None:
            return False
        if learned.distances is not None and learned.distances.is_wrong:
            return False
        yaw = float(wrap_angle(reading.mount.base_from_laser[2] - self._first.base_from_laser[2]))
        return abs(yaw) < MIN_YAW_ERROR and reading.mount.path_ratio >= LEAST

    def estimate(self, expected_lag: int = 0) -> SelfCalibration:
        """What they prove. ``expected_lag`` in nanoseconds is how much later than scans the wheels are
        stamped by the times of recording."""
        track = self._tracker.track()
        scale = self._bearing_scale(track, expected_lag)
        if scale is not None and scale.is_certain:
            track = track_of(with_bearings_scaled(scan, scale.factor) for scan in track.scans)
        order = estimate_sweep_order(track) if self._asks_order else SweepOrder.UNKNOWN
        if order == SweepOrder.REVERSED:
            track = track_of(track.scans, -1.0)
        learned = SelfCalibration(order)
        if self._asks_wheels and len(self._odometry) >= 2:
            learned = self._with_wheels(order, track, expected_lag)
        lag = expected_lag if learned.turns is None else learned.turns.lag
        wheels, gyro = self._turn_ratios(track, lag)
        return replace(learned, bearing_scale=scale, wheel_turns=wheels, gyro_turns=gyro)

    def _bearing_scale(self, track: ScanTrack, expected_lag: int) -> BearingScale | None:
        if self._first is None or self._first.cloud is not None:
            return None  # what was measured as points has the right angles
        walls = wall_straightness(track.scans)
        ratios = [ratio for ratio in self._turn_ratios(track, expected_lag) if ratio is not None]
        return bearing_scale(walls, ratios, self._first)

    def _turn_ratios(self, track: ScanTrack, lag: int) -> tuple[TurnRatio | None, TurnRatio | None]:
        """To the wheels, and to the gyroscope."""
        others = WheelTrack.of(self._odometry), WheelTrack.of_turns(self._yaw_rates)
        wheels, gyro = (turn_ratio(track, other, lag) for other in others)
        return wheels, gyro

    def _with_wheels(self, order: SweepOrder, track: ScanTrack, expected_lag: int) -> SelfCalibration:
        wheels = WheelTrack.of(self._odometry)
        if is_impossible(self._odometry):
            return SelfCalibration(order, odometry_fault=OdometryFault.IMPOSSIBLE)
        motions = motion_pairs(track, wheels, windows_of(track), expected_lag)
        if (fault := fault_in(motions)) is not None:
            has_turns = fault == OdometryFault.WITHOUT_TURNS and self._gyro_agrees(track)
            return SelfCalibration(order, odometry_fault=fault, gyro_has_turns=has_turns)
        turns = turn_agreement(track, wheels, expected_lag, self._max_lag)
        lag, is_inverted = (expected_lag, False) if turns is None else (turns.lag, turns.is_inverted)
        reading = read_motion(track, wheels, lag, is_inverted=is_inverted)
        return SelfCalibration(order, turns, reading, distances=distance_ratio(track, wheels, lag))

    def _gyro_agrees(self, track: ScanTrack) -> bool:
        """Whether the gyroscope shows the turns of the scans, in their sense."""
        if len(self._yaw_rates) < 2:
            return False
        turns = turn_agreement(track, WheelTrack.of_turns(self._yaw_rates), max_lag=self._max_lag)
        return turns is not None and not turns.is_inverted
