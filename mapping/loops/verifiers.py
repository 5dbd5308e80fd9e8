"""The verifiers that there are."""

from racecar.mapping.loops.config import LoopClosureConfig
from racecar.mapping.loops.consistent_support import ConsistentSupportVerifier
from racecar.mapping.loops.see_through_verifier import SeeThroughVerifier
from racecar.mapping.loops.verifier import LoopVerifier


def verifiers(config: LoopClosureConfig) -> list[LoopVerifier]:
    """All of them, in the order in which they are asked."""
    return [
        SeeThroughVerifier(config.see_through),
        ConsistentSupportVerifier(config.consistent_support),
    ]
