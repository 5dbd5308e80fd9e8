"""What may change about the simulated world while the car drives; also ROS parameters."""

from dataclasses import fields

from pydantic import Field

from racecar.maps.settings import Settings
from racecar.pipelines.simulation.driven_simulation import Conditions
from racecar.pipelines.simulation.simulator_config import NoiseLevel


class WorldSettings(Settings):
    """The conditions of a drive."""

    noise: NoiseLevel = Field(
        NoiseLevel.SLIGHT, description="noise of the wheel odometry: none, slight or full"
    )
    slip: float = Field(0.0, ge=0.0, le=0.99, description="wheel slip at full acceleration, a share")
    max_speed: float = Field(2.0, ge=0.3, le=15.0, description="top speed in m/s; bends are slower")
    walkers: int = Field(0, ge=0, le=100, description="number of people walking about")
    dropped_scans: float = Field(0.0, ge=0.0, le=1.0, description="share of the scans that never arrive")
    is_blocked: bool = Field(False, description="whether something covers the laser")

    def conditions(self) -> Conditions:
        """The same as the simulation takes it."""
        return Conditions(**{field.name: getattr(self, field.name) for field in fields(Conditions)})
