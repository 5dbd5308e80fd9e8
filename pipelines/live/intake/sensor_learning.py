"""What the first turns and metres of a drive prove about its sensors, learned aside and used from then on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from threading import Lock

from racecar.pipelines.bags.replay import feed
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.runs.learned_corrections import KnownSensors, learned_corrections
from racecar.sensors.corrections import NO_CORRECTIONS, Corrector
from racecar.sensors.findings import Finding
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.self_calibration import SelfCalibrator
from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG
from racecar.sensors.yaw_rate import YawRate

_BATCH = 100
"""Scans and samples that are handed on at once, about a second of them, since handing on takes time too."""
_MOST = 20_000
"""Scans and samples after which what is known must do, as of bags."""


class SensorLearning:
    """Collects what comes, and corrects what follows."""

    def __init__(
        self,
        known: Callable[[], KnownSensors],
        faults: Faults,
        aside: Callable[[Callable[[], None]], None],
        *,
        moves_laser: bool,
    ) -> None:
        """``known`` says what is known of the sensors otherwise; ``aside`` lets another thread do some work,
        one piece after the other; without ``moves_laser`` its place stays what it is until the end."""
        self._known, self._faults, self._aside = known, faults, aside
        self._moves_laser = moves_laser
        # Clocks that are farther apart show by when messages arrive; a turn or two may suggest any lag.
        self._calibrator = SelfCalibrator(max_lag=USUAL_LAG)
        self._corrections, self._corrector = NO_CORRECTIONS, Corrector(NO_CORRECTIONS)
        self._lock = Lock()
        self._batch: list[Measurement] = []
        self._collected = 0
        self._is_over = False

    @property
    def uses_odometry(self) -> bool:
        """Whether the odometry is worth reading, as far as known by now."""
        return self._corrections.uses_odometry

    def stop(self) -> None:
        """Learn no more."""
        self._is_over = True

    def scan(self, scan: Scan) -> Scan:
        """The scan as it was, as far as known by now."""
        self._collect(scan)
        return self._corrector.scan(scan)

    def odometry(self, odometry: Odometry) -> Odometry | None:
        """The sample as it was; None where it is not worth reading."""
        self._collect(odometry)
        return self._corrector.odometry(odometry) if self.uses_odometry else None

    def yaw_rate(self, yaw_rate: YawRate) -> YawRate:
        """The sample of the gyroscope as it was, as far as known by now."""
        self._collect(yaw_rate)
        return self._corrector.yaw_rate(yaw_rate)

    def _collect(self, item: Measurement) -> None:
        if self._is_over:
            return
        with self._lock:
            self._batch.append(item)
            if len(self._batch) < _BATCH:
                return
            batch, self._batch = self._batch, []
        self._aside(lambda: self._learn(batch))

    def _learn(self, batch: Sequence[Measurement]) -> None:
        for item in batch:
            if self._is_over:
                return
            feed(item, self._calibrator)
            self._collected += 1
            if self._calibrator.is_done or self._collected >= _MOST:
                self._conclude()

    def _conclude(self) -> None:
        learned = self._calibrator.estimate()
        if self._collected < _MOST and self._calibrator.wants_more(learned):
            return
        self._is_over = True
        self._calibrator = SelfCalibrator(max_lag=USUAL_LAG)  # the old one holds thousands of scans
        corrections = learned_corrections(learned, self._known())
        stays: list[Finding] = []
        is_moved = corrections.base_from_laser is not None or corrections.is_upside_down
        if is_moved and not self._moves_laser:
            corrections = replace(corrections, base_from_laser=None, is_upside_down=False)
            stays = [Finding("place_stays")]
        self._corrections, self._corrector = corrections, Corrector(corrections)
        for number, finding in enumerate(corrections.findings):
            self._faults.find(finding, *stays, key=f"learned {number}", lasting=False)
