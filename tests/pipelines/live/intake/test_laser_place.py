"""Where a laser sits is remembered in files, and nothing strange in them is believed."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from racecar.pipelines.live.intake.laser_place import LaserPlace

MATRIX = np.diag([1.0, -1.0, -1.0, 1.0])
"""Upside down."""


def same(found: LaserPlace | None) -> bool:
    return (
        found is not None
        and (found.base_frame, found.laser_frame) == ("base_link", "laser")
        and np.array_equal(found.base_from_laser, MATRIX)
    )


def test_comes_back_from_json() -> None:
    place = LaserPlace("base_link", "laser", MATRIX)
    fields = {**asdict(place), "base_from_laser": MATRIX.tolist()}
    assert same(LaserPlace.from_fields(json.loads(json.dumps(fields))))


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
    assert LaserPlace.from_fields(fields) is None
