"""Save the map of a drive, at its end or while it continues."""

import pickle
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.map_run import MapRun, finish_map
from racecar.pipelines.runs.other_process import in_fresh_process
from racecar.pipelines.runs.output_places import free_folder
from racecar.pipelines.runs.run_context import RunContext
from racecar.sensors.config import SensorConfig


@dataclass(frozen=True)
class MapOutput:
    """Where the map of a live drive is saved, and what identifies the drive."""

    folder: Path
    config: Config
    run: Mapping[str, Any]

    def with_settings(self, sensors: SensorConfig, mapping: MappingConfig) -> "MapOutput":
        """The same with other settings, which the report names, too."""
        config = self.config.model_copy(update={"sensors": sensors, "mapping": mapping})
        named = {"settings": mapping.model_dump(), "sensors": sensors.model_dump()}
        return replace(self, config=config, run={**self.run, **named})

    def save(self, drives: Sequence[Mapper]) -> list[str]:
        """Finish the map of some drives and write all its files; the mappers must be stopped.

        Each drive extends the map of those before if it is recognized there. Otherwise its map goes into a
        separate folder, which the returned sentences name. Raises UserError when there is nothing to save or
        the folder cannot be written.
        """
        earlier, unrecognized = None, []
        for mapper in drives:
            try:
                run = self._finished(mapper, self.folder, earlier)
                earlier = EarlierMap(run.result.session)
            except NotRecognizedError as error:
                own = free_folder(self.folder, lambda: MAP_NAMES)
                self._finished(mapper, own)
                unrecognized.append(f"{error}; its map is in {own}, in a frame of its own.")
        return unrecognized

    def _finished(self, mapper: Mapper, folder: Path, earlier: EarlierMap | None = None) -> MapRun:
        run = finish_map(mapper, RunContext(self.new_report()), folder.name, earlier)
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

    def save_apart(self, drives: bytes) -> None:
        """The same for pickled mappers that continue, in a separate process that leaves the cores to the
        drive. Raises UserError as `save` does."""
        in_fresh_process(partial(save_pickled, self, drives), threads=1, is_urgent=False)


def save_pickled(output: MapOutput, drives: bytes) -> None:
    """`MapOutput.save` for pickled mappers."""
    output.save(pickle.loads(drives))
