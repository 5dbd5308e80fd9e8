"""Compiling what a live mapper needs before the first scan comes, by a short drive."""

from mapping.config import MappingConfig
from mapping.growing_grid import GrowingGrid
from mapping.mapper import Mapper
from maps.scan import Scan
from pipelines.simulator import Simulation
from pipelines.simulator_config import SimulationConfig
from pipelines.warm_up import draw_ring


def warm_up_mapper() -> None:
    """Compile the mapper's kernels, or load them from numba's cache; the drive closes a loop."""
    config = MappingConfig()
    mapper = Mapper(config)
    drive = Simulation(draw_ring(), SimulationConfig(noise="slight", seed=0, duration=14.0))
    for message in drive.messages():
        if isinstance(message, Scan):
            mapper.add_scan(message)
        else:
            mapper.add_odometry(message)
    session = mapper.session()
    GrowingGrid(config.resolution).draw(session.rays, session.map_from_keyframe)
