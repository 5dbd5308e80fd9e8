"""What the beginning of a recording proves about its sensors: all estimators over one track of its scans."""

from dataclasses import dataclass, replace

from racecar.sensors.odometry import Odometry
from racecar.sensors.scaled_bearings import with_bearings_scaled
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.bearing_scale import BearingScale, bearing_scale
from racecar.sensors.self_calibration.mount import LEAST_PATH, MotionReading, read_motion
from racecar.sensors.self_calibration.odometry_fault import OdometryFault, odometry_fault
from racecar.sensors.self_calibration.scan_track import ScanTrack, ScanTracker, track_of
from racecar.sensors.self_calibration.sweep_order import SweepOrder, has_sweep_times, in_sweep_order
from racecar.sensors.self_calibration.turn_agreement import (
    MAX_LAG,
    USUAL_LAG,
    TurnAgreement,
    turn_agreement,
)
from racecar.sensors.self_calibration.wall_straightness import wall_straightness
from racecar.sensors.self_calibration.wheel_track import WheelTrack, motion_pairs
from racecar.sensors.yaw_rate import YawRate

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
    """How the wheels' turns agree with the scans', with the beams where they are."""
    reading: MotionReading | None = None
    """Where the laser sits, which signs are wrong, and how far the wheels go."""
    odometry_fault: OdometryFault | None = None
    bearing_scale: BearingScale | None = None
    """Of scans whose beams lie over another angle than they state."""
    gyro_turns: TurnAgreement | None = None
    """How those of the gyroscope do."""


class SelfCalibrator:
    """Takes scans and odometry of the beginning of a recording, in the order of time, until they suffice."""

    def __init__(self, *, asks_wheels: bool = True, max_lag: int = MAX_LAG) -> None:
        """Without ``asks_wheels`` it is asked for the order of the beams alone. Clocks that are not expected
        to be farther apart are asked about lags up to ``max_lag`` nanoseconds."""
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
            is_open = is_open or self._is_yaw_open(learned)
        is_open = is_open or (is_first and bool(self._yaw_rates) and learned.gyro_turns is None)
        return is_open and len(self._tracker) < _MAX_SCANS and self._level <= _MAX_LEVEL

    def _is_clear(self, learned: SelfCalibration) -> bool:
        """Whether the wheels agree with the scans, as far as such few motions can show."""
        turns, reading = learned.turns, learned.reading
        if turns is None or turns.is_inverted or abs(turns.lag) > USUAL_LAG:
            return False
        if reading is None or self._first is None:
            return False
        is_as_told = reading.mount.yaw_error(self._first.base_from_laser) == 0.0
        return is_as_told and reading.mount.path_ratio >= LEAST_PATH

    def _is_yaw_open(self, learned: SelfCalibration) -> bool:
        return (
            self._first is not None
            and learned.reading is not None
            and learned.reading.mount.leaves_open(self._first.base_from_laser)
        )

    def estimate(self, expected_lag: int = 0) -> SelfCalibration:
        """What they prove. ``expected_lag`` in nanoseconds is how much later than scans the wheels are
        stamped by the times of recording."""
        followed = track = self._tracker.track()
        turns, gyro_turns = self._turns(followed, expected_lag)
        scale = self._bearing_scale(followed, [each for each in (turns, gyro_turns) if each is not None])
        if scale is not None and scale.is_certain:
            track = track_of(with_bearings_scaled(scan, scale.factor) for scan in track.scans)
        order = SweepOrder.UNKNOWN
        if self._asks_order:
            order, track = in_sweep_order(track)
        if track is not followed:
            turns, gyro_turns = self._turns(track, expected_lag)
        learned = SelfCalibration(order, gyro_turns=gyro_turns, bearing_scale=scale)
        if not self._asks_wheels or len(self._odometry) < 2:
            return learned
        wheels = WheelTrack.of(self._odometry)
        fault = odometry_fault(self._odometry, motion_pairs(track, wheels, expected_lag))
        if fault is not None:
            return replace(learned, odometry_fault=fault)
        lag, is_inverted = (expected_lag, False) if turns is None else (turns.lag, turns.is_inverted)
        reading = read_motion(track, wheels, lag, is_inverted=is_inverted)
        return replace(learned, turns=turns, reading=reading)

    def _bearing_scale(self, track: ScanTrack, turns: list[TurnAgreement]) -> BearingScale | None:
        if self._first is None or self._first.cloud is not None:
            return None  # what was measured as points has the right angles
        return bearing_scale(wall_straightness(track.scans), turns, self._first)

    def _turns(
        self, track: ScanTrack, expected_lag: int
    ) -> tuple[TurnAgreement | None, TurnAgreement | None]:
        """Of the wheels, and of the gyroscope beside them."""
        wheels, gyro = WheelTrack.of(self._odometry), WheelTrack.of_turns(self._yaw_rates)
        turns = turn_agreement(track, wheels, expected_lag, self._max_lag)
        lag = expected_lag if turns is None else turns.lag
        return turns, turn_agreement(track, gyro, lag, USUAL_LAG)
