"""The drive of a mapper node, which lasts while the node is deactivated and cleaned up."""

from collections.abc import Callable

from racecar.mapping.mapper import Mapper
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.saving.drive_log import DriveLog
from racecar.pipelines.live.saving.map_saving import MapOutput


class LiveDrive:
    """Its mappers, its log, and where its map is saved."""

    def __init__(self, output: MapOutput, log: DriveLog) -> None:
        """Goes on with the drive of the log, if that was broken off."""
        self.output, self.log = output, log
        self.mappers: list[Mapper] = []
        """One before each long interruption, in order, and the last; none until the node is configured."""
        self.place: LaserPlace | None = None

    @property
    def last_stamp(self) -> int | None:
        """Stamp of the last scan in nanoseconds."""
        return self.mappers[-1].last_stamp if self.mappers else None

    def save(self, inform: Callable[[str], None]) -> None:
        """Finish the map of the stopped drive and write its files. If that fails or is interrupted, the drive
        stays in the log. Raises UserError when there is no map."""
        is_kept = self.last_stamp is not None
        if is_kept:
            inform("Optimizing the map; Ctrl-C breaks that off, and keeps the drive for another time.")
        try:
            for sentence in self.output.save(self.mappers):
                inform(sentence)
            is_kept = self.log.is_unread
        finally:
            if is_kept:
                inform(f"The drive is kept in {self.log.path}; the same command goes on with it.")
            else:
                self.log.remove()
