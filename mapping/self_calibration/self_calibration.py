"""What the beginning of a recording proves about its sensors: all estimators over one track of its scans."""

from dataclasses import dataclass, replace

from racecar.mapping.self_calibration.bearing_scale import BearingScale, bearing_scale
from racecar.mapping.self_calibration.config import SelfCalibrationConfig
from racecar.mapping.self_calibration.distance_ratio import DistanceRatio, distance_ratio
from racecar.mapping.self_calibration.mount import MotionReading, read_motion
from racecar.mapping.self_calibration.odometry_fault import OdometryFault, fault_in, is_impossible
from racecar.mapping.self_calibration.scan_track import ScanTrack, ScanTracker, track_of
from racecar.mapping.self_calibration.sweep_order import SweepOrder, estimate_sweep_order, has_sweep_times
from racecar.mapping.self_calibration.turn_agreement import TurnAgreement, turn_agreement
from racecar.mapping.self_calibration.turn_ratio import TurnRatio, turn_ratio
from racecar.mapping.self_calibration.wall_straightness import wall_straightness
from racecar.mapping.self_calibration.wheel_track import WheelTrack, motion_pairs, windows_of
from racecar.maps.geometry.se2 import wrap_angle
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scaled_bearings import with_bearings_scaled
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.yaw_rate import YawRate


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

    def __init__(self, config: SelfCalibrationConfig, *, asks_wheels: bool = True) -> None:
        """Without ``asks_wheels`` it is asked for the order of the beams alone."""
        self._config = config
        self._asks_order, self._asks_wheels = True, asks_wheels
        self._tracker = ScanTracker(config.track)
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
        tracker, enough = self._tracker, self._config.beginning
        if self._first is not None and not (self._asks_order or self._asks_wheels or self._yaw_rates):
            return len(tracker) >= enough.min_scans  # which show whether walls are straight
        return len(tracker) >= enough.max_scans or (
            len(tracker) >= enough.min_scans
            and tracker.turned > self._level * enough.min_turn
            and tracker.distance > self._level * enough.min_distance
        )

    def wants_more(self, learned: SelfCalibration) -> bool:
        """Whether more of the recording should be looked at, since what is ``learned`` leaves something
        open, or the little that there was speaks against the recording."""
        is_first, self._level = self._level == 1, 2 * self._level
        is_open = self._asks_order and learned.sweep_order == SweepOrder.UNKNOWN
        if self._asks_wheels and learned.odometry_fault is None:
            is_open = is_open or learned.turns is None or (is_first and not self._is_clear(learned))
        is_open = is_open or (is_first and bool(self._yaw_rates) and learned.gyro_turns is None)
        beginning = self._config.beginning
        return is_open and len(self._tracker) < beginning.max_scans and self._level <= beginning.max_level

    def _is_clear(self, learned: SelfCalibration) -> bool:
        """Whether the wheels agree with the scans, as far as such few motions can show."""
        turns, reading, usual = learned.turns, learned.reading, round(self._config.turns.usual_lag * 1e9)
        if turns is None or turns.is_inverted or abs(turns.lag) > usual:
            return False
        if reading is None or self._first is None:
            return False
        mount, doubtful = reading.mount, self._config.mount
        if learned.distances is not None and learned.distances.is_wrong(self._config.distances):
            return False
        yaw = float(wrap_angle(mount.base_from_laser[2] - self._first.base_from_laser[2]))
        return abs(yaw) < doubtful.min_yaw_error and mount.path_ratio >= self._config.distances.least

    def estimate(self, expected_lag: int = 0) -> SelfCalibration:
        """What they prove. ``expected_lag`` in nanoseconds is how much later than scans the wheels are
        stamped by the times of recording."""
        track = self._tracker.track()
        scale = self._bearing_scale(track, expected_lag)
        if scale is not None and scale.is_certain:
            track = track_of(
                [with_bearings_scaled(scan, scale.factor) for scan in track.scans], self._config.track
            )
        order = estimate_sweep_order(track, self._config) if self._asks_order else SweepOrder.UNKNOWN
        if order == SweepOrder.REVERSED:
            track = track_of(track.scans, self._config.track, -1.0)
        learned = SelfCalibration(order)
        if self._asks_wheels and len(self._odometry) >= 2:
            learned = self._with_wheels(order, track, expected_lag)
        lag = expected_lag if learned.turns is None else learned.turns.lag
        wheels, gyro = self._turn_ratios(track, lag)
        return replace(learned, bearing_scale=scale, wheel_turns=wheels, gyro_turns=gyro)

    def _bearing_scale(self, track: ScanTrack, expected_lag: int) -> BearingScale | None:
        if self._first is None or self._first.cloud is not None:
            return None  # what was measured as points has the right angles
        walls = wall_straightness(track.scans, self._config.walls)
        ratios = [ratio for ratio in self._turn_ratios(track, expected_lag) if ratio is not None]
        return bearing_scale(walls, ratios, self._first, self._config)

    def _turn_ratios(self, track: ScanTrack, lag: int) -> tuple[TurnRatio | None, TurnRatio | None]:
        """To the wheels, and to the gyroscope."""
        others = WheelTrack.of(self._odometry), WheelTrack.of_turns(self._yaw_rates)
        config = self._config
        wheels, gyro = (turn_ratio(track, other, config.turn_ratio, config.turns, lag) for other in others)
        return wheels, gyro

    def _with_wheels(self, order: SweepOrder, track: ScanTrack, expected_lag: int) -> SelfCalibration:
        config, wheels = self._config, WheelTrack.of(self._odometry)
        if is_impossible(self._odometry, config.odometry_fault):
            return SelfCalibration(order, odometry_fault=OdometryFault.IMPOSSIBLE)
        motions = motion_pairs(track, wheels, windows_of(track, config.window), expected_lag)
        if (fault := fault_in(motions, config.odometry_fault)) is not None:
            has_turns = fault == OdometryFault.WITHOUT_TURNS and self._gyro_agrees(track)
            return SelfCalibration(order, odometry_fault=fault, gyro_has_turns=has_turns)
        turns = turn_agreement(track, wheels, config.turns, expected_lag)
        lag, is_inverted = (expected_lag, False) if turns is None else (turns.lag, turns.is_inverted)
        reading = read_motion(track, wheels, lag, is_inverted=is_inverted, config=config)
        return SelfCalibration(order, turns, reading, distances=distance_ratio(track, wheels, lag, config))

    def _gyro_agrees(self, track: ScanTrack) -> bool:
        """Whether the gyroscope shows the turns of the scans, in their sense."""
        if len(self._yaw_rates) < 2:
            return False
        turns = turn_agreement(track, WheelTrack.of_turns(self._yaw_rates), self._config.turns)
        return turns is not None and not turns.is_inverted
