from .localization import LocalizationConfig as LocalizationConfig
from .localization import Localizer as Localizer
from .localization import PoseEstimate as PoseEstimate
from .mapping import Mapper as Mapper
from .mapping import MappingConfig as MappingConfig
from .mapping import MappingResult as MappingResult
from .maps import OccupancyGrid as OccupancyGrid
from .maps import Odometry as Odometry
from .maps import Scan as Scan
from .maps import UserError as UserError
from .maps import load_map as load_map
from .maps import save_map as save_map
from .pipelines import BagReader as BagReader

__version__: str
