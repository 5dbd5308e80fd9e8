from .config import MappingConfig as MappingConfig
from .mapper import Mapper as Mapper
from .session.session import Session as Session
from .state.result import MappingResult as MappingResult
