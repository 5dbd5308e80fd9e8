from .localization import LocalizationConfig as LocalizationConfig
from .localization import Localizer as Localizer
from .localization import PoseEstimate as PoseEstimate
from .mapping import Mapper as Mapper
from .mapping import MappingConfig as MappingConfig
from .mapping import MappingResult as MappingResult
from .maps import OccupancyGrid as OccupancyGrid
from .maps import Trajectory as Trajectory
from .maps import UserError as UserError
from .maps import load_map as load_map
from .maps import save_map as save_map
from .pipelines import BagReader as BagReader
from .pipelines import Config as Config
from .pipelines import LocalizationRun as LocalizationRun
from .pipelines import MapRun as MapRun
from .pipelines import localize_bag as localize_bag
from .pipelines import map_bag as map_bag
from .sensors import Odometry as Odometry
from .sensors import Scan as Scan

__version__: str
