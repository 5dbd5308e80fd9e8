"""Save the map of a drive, at its end or while it continues."""

import pickle
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os.path import realpath
from pathlib import Path
from typing import Any

import yaml

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.corrected_session import CorrectedSession, load_corrected
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.map_run import MapRun, extending, finish_map
from racecar.pipelines.runs.other_process import in_fresh_process
from racecar.pipelines.runs.output_places import OccupiedError, free_folder
from racecar.pipelines.runs.run_context import RunContext
from racecar.sensors.config import SensorConfig


@dataclass(frozen=True)
class MapOutput:
    """Where the map of a live drive is saved, and what identifies the drive."""

    folder: Path
    config: Config
    run: Mapping[str, Any]
    continued: CorrectedSession | None = None
    """The earlier map that the drive extends."""
    start: Pose | None = None
    """(3,) pose of the car on it at the start of the drive; None if it must be recognized."""

    def with_settings(self, sensors: SensorConfig, mapping: MappingConfig) -> "MapOutput":
        """The same with other settings, which the report names, too."""
        config = self.config.model_copy(update={"sensors": sensors, "mapping": mapping})
        named = {"settings": mapping.model_dump(), "sensors": sensors.model_dump()}
        return replace(self, config=config, run={**self.run, **named})

    def extending(
        self, folder: Path, start: Pose | None = None, *, starts_at_first: bool = False
    ) -> "MapOutput":
        """The same for a drive that extends the map in a folder. It starts at a pose (3,) there, or where the
        first drive of that map did, or else it must be recognized.

        Raises UserError when there is no such map, an OccupiedError when it would be replaced while the car
        drives.
        """
        if realpath(folder) == realpath(self.folder):
            raise OccupiedError(
                f"The map in {folder} would be replaced while the drive that extends it goes on; name "
                "another folder with --out."
            )
        if folder.with_name(f"{folder.name}.posegraph").is_file():
            raise UserError(
                f"{folder} is a pose graph of slam_toolbox, which only that can read; map a recording of it "
                "with `racecar map`."
            )
        known = load_corrected(folder, RunContext(self.new_report()))
        return replace(
            self, continued=known, start=known.session.map_from_base[0] if starts_at_first else start
        )

    def save(self, drives: Sequence[Mapper]) -> list[str]:
        """Finish the map of some drives and write all its files; the mappers must be stopped.

        Each drive extends the earlier map, or that of the drives before, if it is recognized there. Otherwise
        its map is one of its own, and goes into a separate folder unless it is the first; the returned
        sentences name it. Raises UserError when there is nothing to save or the folder cannot be written.
        """
        known, is_saved, unrecognized = self.continued, False, []
        earlier = None if known is None else EarlierMap(known.session, self.start)
        for mapper in drives:
            try:
                run = self._finished(mapper, self.folder, earlier, known)
            except NotRecognizedError as error:
                own = free_folder(self.folder, lambda: MAP_NAMES) if is_saved else self.folder
                run = self._finished(mapper, own)
                unrecognized.append(f"{error}; its map is in {own}, in a frame of its own.")
                if is_saved:
                    continue
                known = None
            earlier, is_saved = EarlierMap(run.result.session), True
        return unrecognized

    def _finished(
        self,
        mapper: Mapper,
        folder: Path,
        earlier: EarlierMap | None = None,
        known: CorrectedSession | None = None,
    ) -> MapRun:
        report = self.new_report()
        if known is not None:
            report.add("inputs", {"continue": known.folder, "initial_pose": self.start})
        run = finish_map(mapper, RunContext(report), folder.name, earlier)
        if known is not None:
            run = extending(run, known)
        run.save(folder, replace=True)
        return run

    def new_report(self) -> Report:
        """A report that says what identifies the drive."""
        report = Report("racecar live map")
        report.add("inputs", dict(self.run))
        return report

    def copy_map(self, yaml_path: Path) -> None:
        """Copy the saved map to a YAML file elsewhere, and its image beside it. Raises UserError when they
        cannot be written."""
        header = yaml.safe_load((self.folder / "map.yaml").read_text(encoding="utf-8"))
        image = self.folder / header["image"]
        copied = yaml_path.with_name(yaml_path.stem + image.suffix)
        with write_atomically(copied) as partial:
            shutil.copyfile(image, partial)
        with write_atomically(yaml_path) as partial:
            header = {**header, "image": copied.name}
            partial.write_text(yaml.safe_dump(header, sort_keys=False, default_flow_style=None), "utf-8")

    def save_apart(self, drives: bytes) -> list[str]:
        """The same for pickled mappers that continue, in a separate process that leaves the cores to the
        drive. Raises UserError as `save` does."""
        return in_fresh_process(partial(save_pickled, self, drives), threads=1, is_urgent=False)


def save_pickled(output: MapOutput, drives: bytes) -> list[str]:
    """`MapOutput.save` for pickled mappers."""
    return output.save(pickle.loads(drives))
