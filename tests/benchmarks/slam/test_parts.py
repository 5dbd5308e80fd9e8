import pytest

from benchmarks.slam.parts import PARTS


@pytest.mark.parametrize("name", PARTS)
def test_each_part_is_there_to_be_left_out(name: str) -> None:
    for owner, attribute, by in PARTS[name].replacements:
        as_it_is = getattr(owner, attribute)
        with PARTS[name].in_place():
            assert getattr(owner, attribute) == by != as_it_is
        assert getattr(owner, attribute) == as_it_is
