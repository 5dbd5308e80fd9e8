"""The rooms can be drawn on a page."""

from tests.checks.rooms import MOST_ARROWS, MOST_ROOMS, arrows, room


def test_there_are_few_rooms_and_arrows() -> None:
    found = arrows()
    assert len({name for pair in found for name in pair}) <= MOST_ROOMS
    assert 0 < len(found) <= MOST_ARROWS


def test_rooms_are_named_by_their_folders() -> None:
    assert room("racecar.pipelines.bags.storage.mcap") == "pipelines.bags"
    assert room("racecar.mapping.mapper") == "mapping"
    assert room("racecar") == ""
