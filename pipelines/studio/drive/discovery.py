"""Mapping while one drives: the floor that the car has seen so far."""

from pathlib import Path

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.map_outputs import MAP_FILES
from racecar.pipelines.runs.mapping_run import finish_and_save
from racecar.pipelines.runs.output_places import OutputFolder, check_places
from racecar.sensors.measurement import Measurement


class Discovery:
    """A mapper that begins where the car is; its map is shown as it lies in the world."""

    def __init__(self, config: MappingConfig, world_from_map: Pose) -> None:
        """``world_from_map`` (3,): the true pose of the car as it begins, where the map has its origin."""
        self._config, self._world_from_map = config, world_from_map
        self._mapper = Mapper(config)
        self._growing = GrowingGrid(config.resolution, config.rendering)
        self.pose: Pose | None = None
        """(3,) of the car in the world, as the mapper knows it."""

    @property
    def keyframes(self) -> int:
        """How many there are so far."""
        return self._mapper.growth.keyframes

    def take(self, measured: list[Measurement]) -> None:
        """Map what the sensors say."""
        for measurement in measured:
            map_from_base = feed(measurement, self._mapper)
            if map_from_base is not None:
                self.pose = compose(self._world_from_map, map_from_base)

    def keyframe_places(self) -> Pose:
        """(K, 3) poses of the keyframes in the world."""
        return compose(self._world_from_map, self._mapper.session().map_from_base)

    def draw(self) -> OccupancyGrid | None:
        """The map so far, in the world; None before the first keyframe."""
        if not self.keyframes:
            return None
        grid = self._growing.draw(*self._mapper.seen_so_far())
        return OccupancyGrid(grid.cells, grid.resolution, compose(self._world_from_map, grid.map_from_grid))

    def save(self, folder: Path) -> str:
        """Finish the map and write a run's folder; the verdict in words. The discovery is over then.

        Raises UserError when there is no map yet, or the folder cannot be written to or holds what is
        not ours.
        """
        check_places([OutputFolder(folder, lambda: MAP_FILES)], (), force=False)
        report = Report("racecar studio")
        report.add("inputs", {"simulated": True, "settings": self._config.model_dump()})
        return finish_and_save(self._mapper, report, folder).quality.summary
