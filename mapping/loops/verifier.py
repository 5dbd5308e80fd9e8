"""What a loop closure must pass; a new condition is one more file and one more entry in `verifiers.py`."""

from collections.abc import Sequence
from typing import Protocol

from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.mapping.loops.submap_matching import SubmapMatch
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose


class LoopVerifier(Protocol):
    """One condition; what a verifier does not override, it does not object to."""

    def refutes(self, match: SubmapMatch, store: ScanStore) -> bool:
        """Whether a match of two submaps is a wrong one; asked once, when it is found."""
        return False

    def leaves_open(
        self, hypothesis: Hypothesis, others: Sequence[Hypothesis], graph: SubmapGraph, poses: Pose
    ) -> bool:
        """Whether a hypothesis must wait for more evidence; asked each time that a submap has been sought.

        ``others`` are the hypotheses near it along the path, itself among them, and ``poses`` (K, 3) those of
        the keyframes.
        """
        return False
