"""The simulated gyroscope: a cheap MEMS such as the MPU-6050, which measures how fast the car turns."""

import numpy as np

from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.sensors.yaw_rate import YawRate

_BIAS = np.radians(1.5)
"""Radians per second, standard deviation: by judgement, since of the ±20 °/s that the MPU-6050's data sheet
allows few chips have more than 3."""
_NOISE_DENSITY = np.radians(0.005)
"""Radians per second and root of hertz, by the MPU-6050's data sheet."""
_BIAS_WALK = np.radians(0.01)
"""Radians per second and root of a second, by judgement: a quarter of a degree per second in ten minutes, as
a warming chip shows."""
_SCALE = 0.01
"""Standard deviation of the share by which turns are wrong: by judgement; the data sheet allows 3 %."""


def measure_yaw_rates(
    drive: CarMotion, start_ns: int, rate: float, generator: np.random.Generator
) -> list[YawRate]:
    """What the gyroscope says ``rate`` times a second."""
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
