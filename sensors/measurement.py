"""Measurements from the sensors of a car."""

from typing import TypeAlias

from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

Measurement: TypeAlias = Scan | Odometry | YawRate
"""Any measurement; each has a stamp."""
