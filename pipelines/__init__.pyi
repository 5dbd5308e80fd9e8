from .bags.reader import BagReader as BagReader
from .bags.writer import BagWriter as BagWriter
from .files.config_file import Config as Config
from .runs.localization_run import LocalizationRun as LocalizationRun
from .runs.localization_run import localize_bag as localize_bag
from .runs.map_run import MapRun as MapRun
from .runs.mapping_run import map_bag as map_bag
