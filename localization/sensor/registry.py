"""The sensor models, by their names in the settings: a new one is one file and one line here."""

from collections.abc import Callable

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import RangeCodes
from racecar.localization.floor.range_table.range_table import RangeTable
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.config import SensorModelName
from racecar.localization.sensor.likelihood_field import LikelihoodField
from racecar.localization.sensor.sensor_model import SensorModel

MakeSensorModel = Callable[[FreeSpace, Walls, RangeTable | RangeCodes, LocalizationConfig], SensorModel]

SENSOR_MODELS: dict[SensorModelName, MakeSensorModel] = {
    "beam": lambda free_space, _, table, config: BeamModel(
        free_space, table, config.beam_model, config.squash
    ),
    "likelihood_field": lambda free_space, walls, _, config: LikelihoodField(
        free_space, walls, config.likelihood_field, config.squash
    ),
}
