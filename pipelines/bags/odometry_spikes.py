"""Samples of odometry far from those before and after them: single ones, or those of a second publisher."""

from racecar.sensors.findings import Finding, times
from racecar.sensors.odometry import Odometry, is_jump

_SECOND_PUBLISHER = 0.1
"""Share of samples aside from which they are a track of their own, since faults are rare: by judgement."""


class OdometrySpikes:
    """Tells them from the steps of an odometry that begins anew, after which the next sample follows."""

    def __init__(self) -> None:
        self.count = 0
        """Samples left out."""
        self._accepted = 0
        self._last: Odometry | None = None
        self._aside: Odometry | None = None
        self._second: Odometry | None = None
        self._of_second = 0

    def is_spike(self, sample: Odometry) -> bool:
        """Whether the next sample is to be left out; of an odometry that begins anew, the first is too."""
        if self._last is not None and _jumps(self._last, sample):
            if self._aside is None:
                self._leave_out(sample)
                return True
            if not _jumps(self._aside, sample):
                self.count -= 1  # the one before was the first of a new track
        self._last, self._aside = sample, None
        self._accepted += 1
        return False

    def _leave_out(self, sample: Odometry) -> None:
        """Of two in a row that go with neither neighbour, the second is kept: no spikes come so."""
        self.count += 1
        self._of_second += self._second is not None and not _jumps(self._second, sample)
        self._aside = self._second = sample

    @property
    def findings(self) -> list[Finding]:
        """What a person should know of."""
        if self.count == 0:
            return []
        if self.count > _SECOND_PUBLISHER * (self.count + self._accepted):
            if self._of_second < 0.5 * self.count:
                return []  # no track at all: whoever follows the motion says that it is none
            return [Finding("odometry_of_two_programs", times=times(self.count))]
        return [Finding("odometry_spikes", times=times(self.count))]


def _jumps(before: Odometry, after: Odometry) -> bool:
    seconds = (after.stamp - before.stamp) * 1e-9
    return is_jump(before.odom_from_base, after.odom_from_base, seconds)
