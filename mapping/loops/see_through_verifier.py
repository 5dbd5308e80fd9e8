"""See-through: scans of one place lie on each other's surfaces and do not look through them."""

from racecar.mapping.loops.config import SeeThroughVerificationConfig
from racecar.mapping.loops.submap_matching import SubmapMatch
from racecar.mapping.loops.verifier import LoopVerifier
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through


class SeeThroughVerifier(LoopVerifier):
    """Refutes matches whose scans look through each other's surfaces, or see too little in common."""

    def __init__(self, config: SeeThroughVerificationConfig) -> None:
        self._config = config

    def refutes(self, match: SubmapMatch, store: ScanStore) -> bool:
        """By the see-through test of all its pairs of scans."""
        test = see_through(store, match.pairs, match.fixed_poses, match.moving_poses)
        return test.agreement < self._config.min_agreement or test.coverage < self._config.min_coverage
