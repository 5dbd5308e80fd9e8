"""The simulated gyroscope: a cheap MEMS sensor such as the MPU-6050, which measures the yaw rate."""

import numpy as np

from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.sensors.yaw_rate import YawRate

_BIAS = np.radians(1.5)
"""Radians per second, standard deviation. Chosen by judgement: the MPU-6050's data sheet allows ±20 °/s, but
few chips have more than 3."""
_NOISE_DENSITY = np.radians(0.005)
"""Radians per second and square root of hertz, from the MPU-6050's data sheet."""
_BIAS_WALK = np.radians(0.01)
"""Radians per second and square root of a second. Chosen by judgement: a quarter of a degree per second in
ten minutes, as for a chip that warms up."""
_SCALE = 0.01
"""Standard deviation of the scale error. Chosen by judgement; the data sheet allows 3 %."""


def measure_yaw_rates(
    drive: CarMotion, start_ns: int, rate: float, generator: np.random.Generator
) -> list[YawRate]:
    """Yaw rates measured ``rate`` times a second."""
    period = 1.0 / rate
    count = int(drive.seconds / period) + 1
    seconds = period * np.arange(count)
    ticks = TICK * np.arange(len(drive.turning_speed))
    true = np.interp(seconds, ticks, drive.turning_speed)
    bias = _BIAS * generator.standard_normal()
    walk = _BIAS_WALK * np.sqrt(period) * np.cumsum(generator.standard_normal(count))
    noise = _NOISE_DENSITY * np.sqrt(0.5 * rate) * generator.standard_normal(count)
    measured = (1.0 + _SCALE * generator.standard_normal()) * true + bias + walk + noise
    stamps = start_ns + np.rint(seconds * 1e9).astype(np.int64)
    return [YawRate(*sample) for sample in zip(stamps.tolist(), measured.tolist(), strict=True)]
