"""Does the map show the place where the car drove? Judged by how beams agree with it, over the whole drive.

The lost detector cannot tell: it learns how scans agree where the car is taken to be, and a filter finds on
any map a place that the scans fit somehow, such as between the walls of a corridor as wide. What gives a
wrong map away are the beams that would not agree farther along that corridor as well: half of them meet the
right map closely, even one that is out of date, but few a wrong map. Bayes' rule, with shares that are not
learned on the way, turns this into odds. Motion counts, because a car that stands sees the same again; and
the more of it, the farther it leads from where a search chose the best place of all, which fits on any map.
"""

import numpy as np

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.lost_detector import as_array
from racecar.localization.verdict.config import MapFitConfig
from racecar.localization.verdict.pose_steps import PoseSteps

_LEAST = 1e-3
"""No share is taken for less, so that its logarithm is finite whatever the settings say."""


class MapFit:
    """Gathers what the estimates of a drive say of the map."""

    def __init__(self, config: MapFitConfig) -> None:
        self._config = config
        right, wrong = as_array(config.right_map), as_array(config.wrong_map)
        self._log_ratios = np.log(np.maximum(right, _LEAST) / np.maximum(wrong, _LEAST))
        self._steps = PoseSteps(config.step, config.step)
        self._since_step, self._scans_since_step = 0.0, 0
        self._since_search = 0.0
        """Metres of path."""
        self._metres = self._evidence = 0.0
        """Of path that counts, and evidence per beam summed over it."""

    def follow(self, estimate: PoseEstimate) -> None:
        """Take in the estimate of a scan."""
        if estimate.is_start:
            self._since_search = 0.0
        step = self._steps.follow(estimate)
        if estimate.agreement is not None:
            self._since_step += float(self._log_ratios @ estimate.agreement)
            self._scans_since_step += 1
        if step is None or self._scans_since_step == 0:
            return
        distance, angle = step
        metres = min(distance + self._config.metres_per_radian * angle, self._config.longest_step)
        self._since_search += metres
        metres *= min(self._since_search / self._config.chosen_within, 1.0)
        self._metres += metres
        self._evidence += metres * self._since_step / self._scans_since_step
        self._since_step, self._scans_since_step = 0.0, 0

    @property
    def log_odds(self) -> float:
        """Of the right map against a wrong one."""
        config, metres, evidence = self._config, self._metres, self._evidence
        if self._scans_since_step > 0 and metres < config.standing:
            evidence += (config.standing - metres) * self._since_step / self._scans_since_step
            metres = config.standing
        independent = 1.0 + metres / config.longest
        return config.prior_log_odds + config.beams_per_metre * evidence / independent

    @property
    def is_right(self) -> bool:
        """Whether it is the right map, beyond doubt."""
        return self.log_odds >= self._config.sure_log_odds

    @property
    def is_wrong(self) -> bool:
        """Whether it is a wrong one, beyond doubt."""
        return self.log_odds <= -self._config.sure_log_odds
