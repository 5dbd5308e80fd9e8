from .errors import UserError as UserError
from .geometry.se2 import Pose as Pose
from .grid.occupancy_grid import OccupancyGrid as OccupancyGrid
from .map_files import load_map as load_map
from .map_files import save_map as save_map
from .trajectory import Trajectory as Trajectory
