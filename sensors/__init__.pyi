from .cloud import Cloud as Cloud
from .odometry import Odometry as Odometry
from .scan import Scan as Scan
