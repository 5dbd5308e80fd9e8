"""Time stamps as messages hold them."""

from types import SimpleNamespace as Some

import pytest

from racecar.pipelines.bags.messages import nanoseconds


@pytest.mark.parametrize(
    ("sec", "nanosec", "expected"),
    [(2, 5, 2_000_000_005), (0, 0, 0), (-5, 0, 0), (-(2**31), 2**32 - 1, 0), (1_700_000_000, 10**9, 0)],
)
def test_a_stamp_whose_fields_are_not_valid_is_none(sec: int, nanosec: int, expected: int) -> None:
    assert nanoseconds(Some(sec=sec, nanosec=nanosec)) == expected
