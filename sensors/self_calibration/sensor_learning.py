"""What the first turns and metres of a drive prove about its sensors, learned aside and used from then on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from threading import Lock

from racecar.sensors.corrections import NO_CORRECTIONS, Corrector
from racecar.sensors.findings import Finding
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.learned_corrections import KnownSensors, learned_corrections
from racecar.sensors.self_calibration.self_calibration import SelfCalibrator
from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG
from racecar.sensors.yaw_rate import YawRate

_BATCH = 100
"""Scans and samples that are handed on at once, about a second of them, since handing on takes time too."""


class SensorLearning:
    """Between the sensors and a `Mapper` or `Localizer`: collects what comes, and corrects what follows."""

    def __init__(
        self,
        known: Callable[[], KnownSensors],
        tell: Callable[[Sequence[Finding]], None] = lambda findings: None,
        aside: Callable[[Callable[[], None]], None] = lambda work: work(),
        *,
        moves_laser: bool = True,
    ) -> None:
        """``known`` returns what is known about the sensors otherwise. ``tell`` receives the finding of each
        correction, with what there is to add. ``aside`` runs work in another thread, one piece at a time.
        Without ``moves_laser`` the laser's place is kept until the end."""
        self._known, self._tell, self._aside, self._moves_laser = known, tell, aside, moves_laser
        # Clocks that are farther apart show by when messages arrive; a turn or two may suggest any lag.
        self._calibrator: SelfCalibrator | None = SelfCalibrator(max_lag=USUAL_LAG)
        """None once it is over, as it holds thousands of scans."""
        self._corrector = Corrector(NO_CORRECTIONS)
        self._lock = Lock()
        self._batch: list[Measurement] = []
        self.uses_odometry = True
        """Whether the odometry is good enough to read, as far as known so far."""

    def stop(self) -> None:
        """Learn no more."""
        self._calibrator = None

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
        if self._calibrator is None:
            return
        with self._lock:
            self._batch.append(item)
            if len(self._batch) < _BATCH:
                return
            batch, self._batch = self._batch, []
        self._aside(lambda: self._learn(batch))

    def _learn(self, batch: Sequence[Measurement]) -> None:
        for item in batch:
            calibrator = self._calibrator
            if calibrator is None:
                return
            learned = calibrator.learn(item)
            if learned is None:
                continue
            self._calibrator = None
            corrections, stays = learned_corrections(learned, self._known()), []
            is_moved = corrections.base_from_laser is not None or corrections.is_upside_down
            if is_moved and not self._moves_laser:
                corrections = replace(corrections, base_from_laser=None, is_upside_down=False)
                stays = [Finding("place_stays")]
            self._corrector, self.uses_odometry = Corrector(corrections), corrections.uses_odometry
            for finding in corrections.findings:
                self._tell([finding, *stays])
