"""Mapping while driving: the floor that the car has seen so far."""

from pathlib import Path

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import Pose, compose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.map_run import finish_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.studio.drive.follower import Follower
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan


class Discovery(Follower):
    """A mapper that starts at the car's pose; its map is shown in the world frame."""

    def __init__(self, config: MappingConfig, world_from_map: Pose) -> None:
        """``world_from_map`` (3,): the car's true pose at the start, which is the origin of the map."""
        super().__init__()
        self._config, self._world_from_map = config, world_from_map
        self._mapper = Mapper(config)
        self._growing = GrowingGrid(config.resolution, config.rendering)
        self.pose: Pose | None = None
        """(3,) the car's pose in the world, as estimated by the mapper."""

    @property
    def keyframes(self) -> int:
        """Number of keyframes so far."""
        return self._mapper.growth.keyframes

    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        """Map the sensor data."""
        for measurement in measured:
            map_from_base = feed(measurement, self._mapper)
            if map_from_base is not None:
                self.pose = compose(self._world_from_map, map_from_base)
        if self.pose is not None:
            self.note_error(self.pose, truth, seconds)

    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        """Includes the path of the keyframes."""
        if self.pose is None or scan is None:
            return None
        path = compose(self._world_from_map, self._mapper.session().map_from_base)
        return Glimpse(self.pose, transform_points(self.pose, scan.points_in_base()), path)

    def map(self) -> OccupancyGrid | None:
        """The map so far, in the world; None before the first keyframe."""
        if not self.keyframes:
            return None
        grid = self._growing.draw(*self._mapper.seen_so_far())
        return OccupancyGrid(grid.cells, grid.resolution, compose(self._world_from_map, grid.map_from_grid))

    def words(self) -> str:
        """How much has been mapped."""
        off = f", off by **{100 * self.errors[-1].metres:.1f} cm**" if self.errors else ""
        return f"The mapper: {self.keyframes} keyframes{off}."

    def save(self, folder: Path) -> str:
        """Finish the map and write a run's folder, in place of what is there; returns the verdict in words.
        This ends the discovery.

        Raises UserError when there is no map yet, or the folder cannot be written to.
        """
        context = RunContext(Report("racecar studio"))
        context.report.add("inputs", {"simulated": True, "settings": self._config.model_dump()})
        run = finish_map(self._mapper, context, folder.name)
        run.save(folder, replace=True)
        return run.quality.summary
