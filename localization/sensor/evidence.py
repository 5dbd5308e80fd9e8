"""What a scan is worth as evidence of the place: 1 if it repeats no other and the map explains it.

Scans taken near each other see the same people, the same moved furniture and the same errors of the map, and
so do the beams of one scan; counted as independent they would make a cloud sure of the place where these
happen to fit. So a scan counts by the share of an independent one's travel that lies between it and the last,
and the scans of a car that stands do not count. Where the map is wrong about much of what a scan sees, it may
be wrong about the rest too: a scan of which little fits counts less.
"""

from racecar.localization.sensor.config import EvidenceConfig


def worth(travel: float, fitting: float, config: EvidenceConfig) -> float:
    """The share of its log-likelihood by which a scan counts, 0 to 1.

    It was taken so many metres plus radians after the last one that counted, and a share of its beams agrees
    with the map.
    """
    is_new = min(travel / config.independent_after, 1.0)
    return is_new * min(fitting / config.usual_share, 1.0) ** config.steepness
