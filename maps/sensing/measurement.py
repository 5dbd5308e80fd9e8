"""What sensors of a car send."""

from typing import TypeAlias

from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.yaw_rate import YawRate

Measurement: TypeAlias = Scan | Odometry | YawRate
"""One of them; each has a stamp."""
