from .bags.reader import BagReader as BagReader
from .bags.writer import BagWriter as BagWriter
