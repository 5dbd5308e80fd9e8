"""Does the map show the place where the car drove? Judged by whether scans fit other places better.

Even on a map that is out of date a scan fits nowhere notably better than where it was taken. On a wrong map
it fits somehow where the filter follows it, as between the walls of a corridor as wide, and better elsewhere,
each scan at another place. What was compared on a metre of path counts as one observation, and nothing of a
car that stands, because it sees the same again; and the more, the farther it is from where a search chose the
best place of all, which fits on any map.
"""

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.pose_steps import PoseSteps

STEP = 0.1
"""Metres of motion, and radians, after which scans count anew, since what the estimate of a car that stands
jitters is less."""
_METRES_PER_RADIAN = 0.5
"""Of path for which a turn on the spot counts, since it shows other walls, but less than driving does. By
judgement."""
_LONGEST_STEP = 3.0
"""Metres of path for which a scan counts at most, so that none decides alone where few are taken. By
judgement."""
_LONGEST = 10.0
"""Metres of path to whose evidence that of a long drive adds up at most, so that a small bias, of a laser or
of a map that is out of date, does not become certainty. By judgement."""
_CHOSEN_WITHIN = 3.0
"""Metres of path after a search of the map, below which scans count for less, down to nothing where the
search chose the place that fits best. Measured: on wrong maps scans fit for 2 to 6 m as on the right one."""
_PRIOR_LOG_ODDS = 1.0
"""For the map before any scan, since people name the right map more often. By judgement."""
_RIGHT_FROM, _WRONG_FROM = 4.0, -3.0
"""Log-odds from which on the map counts as the right one, or as a wrong one. Measured: on 19 wrong maps of
the foreign simulator they come to 3.8 at most, on its right ones to 4.3 at least."""
_LEAST_FIT = 0.6
"""Mean fit of scans below which nothing shows that the map is the right one, as where every place of a small
map fits as badly. Measured: on the right maps, with half of the furniture moved, too, it is 0.73 at least, on
the shipped track it was 0.49 of a drive elsewhere that fitted nowhere better."""
_AS_WELL = 1.0
"""Log-likelihood by which scans of the right map may fit elsewhere better, as those along a corridor do by
chance. Measured on 38 foreign drives and eight recordings with two seeds: the least of a second is higher on
right maps in 9 of 10 cases, on wrong maps in 4."""
_MOST = 4.0
"""Log-likelihood above or below that from which a comparison says no more: by judgement, what one corner or
crate does to a scan."""
_PER_METRE = 1.5
"""Log-odds that a metre of path brings at most. By judgement: three metres past a doubtful place decide."""


class MapFit:
    """Gathers what the estimates of a drive say of the map."""

    def __init__(self) -> None:
        self._steps = PoseSteps(STEP, STEP)
        self._since_look = self._since_search = 0.0
        """Metres of path."""
        self._metres = self._evidence = 0.0
        """Of path that counts, and what speaks for the map on it, from -1 to 1 for each."""
        self._fits, self._scans = 0.0, 0
        """The sum over the scans that had any, and their number."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Take in the estimate of a scan."""
        if estimate.is_start:
            self._since_search = self._since_look = 0.0
        metres, radians = self._steps.follow(estimate)
        path = metres + _METRES_PER_RADIAN * radians
        self._since_search += path
        self._since_look += path
        if estimate.fit is not None:
            self._fits += estimate.fit
            self._scans += 1
        if estimate.margin is None:
            return
        metres = min(self._since_look, _LONGEST_STEP)
        metres *= min(self._since_search / _CHOSEN_WITHIN, 1.0)
        self._metres += metres
        self._evidence += metres * min(max((estimate.margin + _AS_WELL) / _MOST, -1.0), 1.0)
        self._since_look = 0.0

    @property
    def log_odds(self) -> float:
        """Of the right map against a wrong one."""
        independent = 1.0 + self._metres / _LONGEST
        return _PRIOR_LOG_ODDS + _PER_METRE * self._evidence / independent

    @property
    def is_right(self) -> bool:
        """Whether it is the right map, beyond doubt."""
        return self.log_odds >= _RIGHT_FROM and self._fits >= _LEAST_FIT * self._scans

    @property
    def is_wrong(self) -> bool:
        """Whether it is a wrong one, beyond doubt."""
        return self.log_odds <= _WRONG_FROM
