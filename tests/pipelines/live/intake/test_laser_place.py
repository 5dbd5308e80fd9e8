"""Where a laser sits is remembered in files, and nothing strange in them is believed."""

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from racecar.pipelines.live.intake.laser_place import LaserPlace

PLACES = TypeAdapter(LaserPlace)
MATRIX = np.diag([1.0, -1.0, -1.0, 1.0])
"""Upside down."""


def test_comes_back_from_json() -> None:
    found = PLACES.validate_json(PLACES.dump_json(LaserPlace("base_link", "laser", MATRIX)))
    assert (found.base_frame, found.laser_frame) == ("base_link", "laser")
    np.testing.assert_array_equal(found.base_from_laser, MATRIX)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        None,
        "laser",
        {"base_frame": "base_link", "laser_frame": "laser", "base_from_laser": np.eye(3)},
        {"base_frame": "base_link", "laser_frame": "laser", "base_from_laser": np.full((4, 4), np.nan)},
        {"base_frame": "base_link", "laser_frame": "laser", "base_from_laser": "there"},
    ],
)
def test_what_is_no_place_is_left(fields: object) -> None:
    with pytest.raises(ValidationError):
        PLACES.validate_python(fields)
