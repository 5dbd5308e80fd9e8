"""Odometry samples far from their neighbours: isolated ones, or those of a second publisher."""

from racecar.sensors.findings import Finding, times
from racecar.sensors.odometry import Odometry, is_jump

_SECOND_PUBLISHER = 0.1
"""Share of outliers from which they form a track of their own, since faults are rare. Chosen by judgement."""


class OdometrySpikes:
    """Distinguishes spikes from the jump of an odometry that restarts, which the next sample follows."""

    def __init__(self) -> None:
        self.count = 0
        """Samples dropped."""
        self._accepted = 0
        self._last: Odometry | None = None
        self._aside: Odometry | None = None
        self._second: Odometry | None = None
        self._of_second = 0

    def is_spike(self, sample: Odometry) -> bool:
        """Whether to drop the next sample; the first sample of an odometry that restarts is also dropped."""
        if self._last is not None and _jumps(self._last, sample):
            if self._aside is None:
                self._leave_out(sample)
                return True
            if not _jumps(self._aside, sample):
                self.count -= 1  # the previous one was the first of a new track
        self._last, self._aside = sample, None
        self._accepted += 1
        return False

    def _leave_out(self, sample: Odometry) -> None:
        """Drop a sample. Of two in a row that match neither neighbour, the second is no spike and is kept."""
        self.count += 1
        self._of_second += self._second is not None and not _jumps(self._second, sample)
        self._aside = self._second = sample

    @property
    def findings(self) -> list[Finding]:
        """Findings for the user."""
        if self.count == 0:
            return []
        if self.count > _SECOND_PUBLISHER * (self.count + self._accepted):
            if self._of_second < 0.5 * self.count:
                return []  # no track at all, which is reported where the motion is followed
            return [Finding("odometry_of_two_programs", times=times(self.count))]
        return [Finding("odometry_spikes", times=times(self.count))]


def _jumps(before: Odometry, after: Odometry) -> bool:
    seconds = (after.stamp - before.stamp) * 1e-9
    return is_jump(before.odom_from_base, after.odom_from_base, seconds)
