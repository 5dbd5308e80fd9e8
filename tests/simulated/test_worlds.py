"""Worlds with the faults of recordings are mapped as well as `python -m benchmarks worlds` says."""

import pytest

from benchmarks.worlds.worlds import WORLDS, map_drive
from racecar.mapping.config import MappingConfig

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("world", "metres"),
    [
        ("plain", 0.02),
        ("tilted", 0.05),
        ("tilted short", 0.05),
        ("posts", 0.02),
        ("carried", 0.05),
        ("carrier", 0.05),
        ("follower", 0.05),
        ("short", 0.05),
        ("one per 1 s", 0.05),
        ("gaps", 0.05),
        ("campus", 0.05),
    ],
)
def test_a_world_is_mapped_to_centimetres(world: str, metres: float) -> None:
    drive = map_drive(WORLDS[world], 0, MappingConfig())
    assert drive.placed == drive.scans
    assert drive.errors.relation_m <= metres
    assert drive.errors.heading_deg <= 0.5
