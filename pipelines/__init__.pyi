from .bags.reader import BagReader as BagReader
from .bags.writer import BagWriter as BagWriter
from .files.config_file import Config as Config
from .runs.localized_bag import LocalizedBag as LocalizedBag
from .runs.localized_bag import localize_bag as localize_bag
from .runs.mapped_bag import MappedBag as MappedBag
from .runs.mapped_bag import map_bag as map_bag
