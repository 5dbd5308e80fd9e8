"""What sensors of a car send."""

from typing import TypeAlias

from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

Measurement: TypeAlias = Scan | Odometry | YawRate
"""One of them; each has a stamp."""
