"""What a time without scans says of the car."""

import numpy as np
import pytest

from racecar.mapping.keyframes.gap import Gap, gap_after

FAR, NEAR = np.array([0.9, 0.3, 0.2]), np.array([0.3, 0.0, 2.0])


@pytest.mark.parametrize(
    ("seconds", "step", "gap"),
    [
        (0.5, FAR, Gap.NONE),
        (0.6, FAR, Gap.DRIVEN),
        (0.6, NEAR, Gap.NONE),
        (0.6, None, Gap.NONE),
        (2.1, FAR, Gap.DRIVEN),
        (2.1, NEAR, Gap.LEFT_ALONE),
        (2.1, None, Gap.LEFT_ALONE),
    ],
)
def test_a_car_that_stood_must_be_out_of_sight_for_longer(
    seconds: float, step: np.ndarray | None, gap: Gap
) -> None:
    assert gap_after(round(seconds * 1e9), step, 0.3) == gap
