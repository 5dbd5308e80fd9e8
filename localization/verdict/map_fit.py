"""Does the map show the place where the car drove? Judged by whether scans fit other places better.

Even on a map that is out of date a scan fits nowhere notably better than where it was taken. On a wrong map
it fits somehow where the filter follows it, as between the walls of a corridor as wide, and better elsewhere,
each scan at another place. What was compared on a metre of path counts as one observation, because a car that
stands sees the same again; and the more, the farther it is from where a search chose the best place of all,
which fits on any map.
"""

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.config import MapFitConfig
from racecar.localization.verdict.pose_steps import PoseSteps

_AS_WELL = 1.0
"""Log-likelihood by which scans of the right map may fit elsewhere better, as those along a corridor do by
chance. Measured on 38 foreign drives and eight recordings with two seeds: the least of a second is higher on
right maps in 9 of 10 cases, on wrong maps in 4."""
_MOST = 4.0
"""Log-likelihood above or below that from which a comparison says no more: what one corner or crate does to a
scan. By judgement."""
_PER_METRE = 1.5
"""Log-odds that a metre of path brings at most. By judgement: three metres past a doubtful place decide."""


class MapFit:
    """Gathers what the estimates of a drive say of the map."""

    def __init__(self, config: MapFitConfig) -> None:
        self._config = config
        self._steps = PoseSteps(config.step, config.step)
        self._since_look = self._since_search = 0.0
        """Metres of path."""
        self._metres = self._evidence = 0.0
        """Of path that counts, and what speaks for the map on it, from -1 to 1 for each."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Take in the estimate of a scan."""
        config = self._config
        if estimate.is_start:
            self._since_search = self._since_look = 0.0
        step = self._steps.follow(estimate)
        if step is not None:
            metres = step[0] + config.metres_per_radian * step[1]
            self._since_search += metres
            self._since_look += metres
        if estimate.margin is None:
            return
        metres = min(max(self._since_look, config.standing), config.longest_step)
        metres *= min(self._since_search / config.chosen_within, 1.0)
        self._metres += metres
        self._evidence += metres * min(max((estimate.margin + _AS_WELL) / _MOST, -1.0), 1.0)
        self._since_look = 0.0

    @property
    def log_odds(self) -> float:
        """Of the right map against a wrong one."""
        independent = 1.0 + self._metres / self._config.longest
        return self._config.prior_log_odds + _PER_METRE * self._evidence / independent

    @property
    def is_right(self) -> bool:
        """Whether it is the right map, beyond doubt."""
        return self.log_odds >= self._config.sure_log_odds

    @property
    def is_wrong(self) -> bool:
        """Whether it is a wrong one, beyond doubt."""
        return self.log_odds <= -self._config.sure_log_odds
