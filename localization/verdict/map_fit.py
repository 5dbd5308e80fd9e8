"""Judge whether the map shows the place of the drive, by whether scans fit better elsewhere on it.

Even on an outdated map a scan fits nowhere notably better than where it was taken. On a wrong map it fits
somehow where the filter tracks it, as in a corridor of equal width, and better elsewhere, each scan at
another place. Comparisons on a metre of path count as one observation, and none while the car stands, because
it sees the same again. They count more with the distance from where a search chose the best place, which fits
on any map.
"""

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.pose_steps import PoseSteps

STEP = 0.1
"""Metres of motion, or radians, after which scans count again, since the jitter of a standing car's estimate
is less."""
_METRES_PER_RADIAN = 0.5
"""Path in metres equivalent to a radian of turning on the spot, since that shows other walls, but less than
driving does. Chosen by judgement."""
_LONGEST_STEP = 3.0
"""Most metres of path that a scan counts for, so that none decides alone where scans are sparse. Chosen by
judgement."""
_LONGEST = 10.0
"""Most metres of path that evidence accumulates to, so that a small bias, of a laser or an outdated map, does
not become certainty. Chosen by judgement."""
_CHOSEN_WITHIN = 3.0
"""Metres of path after a search of the map over which the weight of scans rises from zero, because the search
chose the place that fits best. Measured: on wrong maps scans fit for 2 to 6 m as on the right one."""
_PRIOR_LOG_ODDS = 1.0
"""Prior log-odds of the map, since people name the right map more often. Chosen by judgement."""
_RIGHT_FROM, _WRONG_FROM = 4.0, -3.0
"""Log-odds from which the map is right, or wrong. Measured: on 19 wrong maps of the foreign simulator they
come to 3.8 at most, on its right ones to 4.3 at least."""
_LEAST_FIT = 0.6
"""Mean fit of scans below which the map is never confirmed, as where every place of a small map fits equally
badly. Measured: on the right maps, with half of the furniture moved, too, it is 0.73 at least, on the shipped
track it was 0.49 of a drive elsewhere that fitted nowhere better."""
_AS_WELL = 1.0
"""Log-likelihood by which scans may fit better elsewhere on the right map, as in a corridor by chance.
Measured on 38 foreign drives and eight recordings with two seeds: the least of a second is higher on right
maps in 9 of 10 cases, on wrong maps in 4."""
_MOST = 4.0
"""Log-likelihood above or below that at which a comparison is clipped. Chosen by judgement: the effect of one
corner or crate on a scan."""
_PER_METRE = 1.5
"""Maximum log-odds per metre of path. Chosen by judgement: three metres past a doubtful place decide."""


class MapFit:
    """Accumulates evidence about the map from the estimates of a drive."""

    def __init__(self) -> None:
        self._steps = PoseSteps(STEP, STEP)
        self._since_look = self._since_search = 0.0
        """Metres of path."""
        self._metres = self._evidence = 0.0
        """Counted metres of path, and evidence for the map on them, from -1 to 1 per metre."""
        self._fits, self._scans = 0.0, 0
        """Sum of the fits, and the number of scans with one."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Add the estimate of a scan."""
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
        """Log-odds of a right map over a wrong one."""
        independent = 1.0 + self._metres / _LONGEST
        return _PRIOR_LOG_ODDS + _PER_METRE * self._evidence / independent

    @property
    def is_right(self) -> bool:
        """Whether the map is certainly right."""
        return self.log_odds >= _RIGHT_FROM and self._fits >= _LEAST_FIT * self._scans

    @property
    def is_wrong(self) -> bool:
        """Whether the map is certainly wrong."""
        return self.log_odds <= _WRONG_FROM
