from .config import MappingConfig as MappingConfig
from .mapper import Mapper as Mapper
from .mapper import MappingResult as MappingResult
from .session.session import Session as Session
