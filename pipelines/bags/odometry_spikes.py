"""Samples of odometry far from those before and after them: single ones, or those of a second publisher."""

from racecar.maps.sensing.odometry import Odometry, is_jump
from racecar.pipelines.bags.findings import Finding, times

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

    def is_spike(self, sample: Odometry) -> bool:
        """Whether the next sample is to be left out; of an odometry that begins anew, the first is too."""
        if self._last is not None and _jumps(self._last, sample):
            is_new_track = self._aside is not None and not _jumps(self._aside, sample)
            if not is_new_track:
                self._aside = sample
                self.count += 1
                return True
            self.count -= 1  # the one before was the first of it
        self._last, self._aside = sample, None
        self._accepted += 1
        return False

    @property
    def findings(self) -> list[Finding]:
        """What a person should know of."""
        if self.count == 0:
            return []
        if self.count > _SECOND_PUBLISHER * (self.count + self._accepted):
            what = (
                f"The odometry goes to and fro between two tracks, {times(self.count)}: two programs publish "
                "it, of which the first is followed."
            )
            return [Finding(what, "Let only one node publish it, such as the driver or a filter.")]
        what = f"The odometry is elsewhere for a single sample, {times(self.count)}: these are left out."
        return [Finding(what, "See what disturbs its node, and that only one publishes it.")]


def _jumps(before: Odometry, after: Odometry) -> bool:
    seconds = (after.stamp - before.stamp) * 1e-9
    return is_jump(before.odom_from_base, after.odom_from_base, seconds)
