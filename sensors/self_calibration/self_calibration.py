"""Self-calibration from the beginning of a recording: run all estimators on one scan track."""

from dataclasses import dataclass, replace

from racecar.sensors.measurement import Measurement
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
"""Minimum number of tracked scans. Chosen by judgement: some seconds."""
_MAX_SCANS = 2000
"""Most tracked scans, so that it takes seconds. Chosen by judgement: two minutes of a fast laser."""
_ENOUGH_TURN, _ENOUGH_DISTANCE = 3.0, 3.0
"""Radians, either way, and metres of path that may suffice if no fault is suspected. Chosen by judgement:
half of what finding faults needs."""
MOST = 20_000
"""Most measurements looked at, so that of a recording that stands still only some minutes are."""
_MAX_LEVEL = 8
"""Factor by which both may grow while a question is open. Chosen by judgement: a minute or two."""


@dataclass(frozen=True, eq=False)
class SelfCalibration:
    """Calibration results; None or unknown where the recording does not show them."""

    sweep_order: SweepOrder = SweepOrder.UNKNOWN
    turns: TurnAgreement | None = None
    """Agreement of the wheels' turns with those of the scans, after sorting the beams."""
    reading: MotionReading | None = None
    """Mount of the laser, wrong signs and path ratio."""
    odometry_fault: OdometryFault | None = None
    bearing_scale: BearingScale | None = None
    """Scale error of the bearings."""
    gyro_turns: TurnAgreement | None = None
    """Agreement of the gyroscope's turns with those of the scans."""


class SelfCalibrator:
    """Collect scans and odometry from the beginning of a recording, in time order, until they suffice."""

    def __init__(self, *, asks_wheels: bool = True, max_lag: int = MAX_LAG) -> None:
        """Without ``asks_wheels``, only the beam order is estimated. Lags are searched up to ``max_lag``
        nanoseconds, for clocks that are known to be closer."""
        self._max_lag = max_lag
        self._asks_order, self._asks_wheels = True, asks_wheels
        self._tracker = ScanTracker()
        self._odometry: list[Odometry] = []
        self._yaw_rates: list[YawRate] = []
        self._first: Scan | None = None
        self._level, self._taken = 1, 0

    def learn(self, item: Measurement, expected_lag: int = 0) -> SelfCalibration | None:
        """Take a measurement; what all so far prove, see `estimate`, once they are enough or more would not
        help."""
        if isinstance(item, Scan):
            self.add_scan(item)
        elif isinstance(item, Odometry):
            self.add_odometry(item)
        else:
            self.add_yaw_rate(item)
        self._taken += 1
        if not self._is_done and self._taken < MOST:
            return None
        learned = self.estimate(expected_lag)
        return None if self._taken < MOST and self._wants_more(learned) else learned

    def add_odometry(self, odometry: Odometry) -> None:
        """Add a wheel odometry sample."""
        if self._asks_wheels:
            self._odometry.append(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample, to estimate its scale and lag, and turns that wheels lack."""
        self._yaw_rates.append(yaw_rate)

    def add_scan(self, scan: Scan) -> None:
        """Add a scan; of several lasers only the first is tracked."""
        if self._first is None:
            self._first = scan
            self._asks_order = self._asks_order and has_sweep_times(scan)
        if scan.laser == self._first.laser:
            self._tracker.add(scan)

    @property
    def _is_done(self) -> bool:
        """Whether the scans so far suffice, or more would not help."""
        tracker = self._tracker
        if self._first is not None and not (self._asks_order or self._asks_wheels or self._yaw_rates):
            return len(tracker) >= _MIN_SCANS  # enough to judge straight walls
        return len(tracker) >= _MAX_SCANS or (
            len(tracker) >= _MIN_SCANS
            and tracker.turned > self._level * _ENOUGH_TURN
            and tracker.distance > self._level * _ENOUGH_DISTANCE
        )

    def _wants_more(self, learned: SelfCalibration) -> bool:
        """Whether to read more of the recording: something in ``learned`` is open, or little data suggests a
        fault."""
        is_first, self._level = self._level == 1, 2 * self._level
        is_open = self._asks_order and learned.sweep_order == SweepOrder.UNKNOWN
        if self._asks_wheels and learned.odometry_fault is None:
            is_open = is_open or learned.turns is None or (is_first and not self._is_clear(learned))
            is_open = is_open or self._is_yaw_open(learned)
        is_open = is_open or (is_first and bool(self._yaw_rates) and learned.gyro_turns is None)
        return is_open and len(self._tracker) < _MAX_SCANS and self._level <= _MAX_LEVEL

    def _is_clear(self, learned: SelfCalibration) -> bool:
        """Whether the wheels agree with the scans, as far as so few motions show."""
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
        """Estimate everything. ``expected_lag`` is the delay in nanoseconds of wheel stamps after scan stamps
        according to the times of recording."""
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
            return None  # clouds are points, so their angles are right
        return bearing_scale(wall_straightness(track.scans), turns, self._first)

    def _turns(
        self, track: ScanTrack, expected_lag: int
    ) -> tuple[TurnAgreement | None, TurnAgreement | None]:
        """Agreement of the wheels and, given their lag, of the gyroscope."""
        wheels, gyro = WheelTrack.of(self._odometry), WheelTrack.of_turns(self._yaw_rates)
        turns = turn_agreement(track, wheels, expected_lag, self._max_lag)
        lag = expected_lag if turns is None else turns.lag
        return turns, turn_agreement(track, gyro, lag, USUAL_LAG)
