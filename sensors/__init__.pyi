from .cloud import Cloud as Cloud
from .fixed_returns.fixed_returns import FixedReturns as FixedReturns
from .odometry import Odometry as Odometry
from .scan import Scan as Scan
from .self_calibration.learned_corrections import KnownSensors as KnownSensors
from .self_calibration.sensor_learning import SensorLearning as SensorLearning
