"""Save edits beside their map, and render the map with them."""

from collections.abc import Callable, Sequence
from os.path import realpath
from pathlib import Path

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.map_files import load_map
from racecar.pipelines.files.edits_file import EDITS_FILE, MapEdits, edits_beside, save_edits
from racecar.pipelines.files.outputs import written_to
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.map_run import MapRun
from racecar.pipelines.runs.output_places import OutputFolder
from racecar.pipelines.runs.render_run import render_run
from racecar.pipelines.runs.run_context import RunContext


class Saving:
    """Saves the edits of the map in a folder."""

    def __init__(self, folder: Path, config: MappingConfig, saved: MapEdits) -> None:
        """``config`` sets how the map is rendered; ``saved`` are the edits that the folder holds."""
        self._folder, self._config, self._saved = folder, config, saved

    def is_saved(self, edits: MapEdits) -> bool:
        """Whether these are the edits that were last saved."""
        return edits.text == self._saved.text

    def place(self, out: Path) -> OutputFolder:
        """Where a map in ``out`` is written to."""
        return OutputFolder(out, lambda: MAP_NAMES, (self._folder,))

    def save(
        self,
        edits: MapEdits,
        out: Path,
        check: Callable[[OutputFolder, Sequence[Path]], None],
        *,
        is_straightened: bool,
        is_cropped: bool,
    ) -> str:
        """Write the edits beside their map and render it into ``out``; returns what was written, in words.

        ``check`` raises UserError when the map shall not be written there, made from what is read. Raises
        UserError, too, when a folder cannot be written to, when the edits were changed elsewhere meanwhile,
        and when the map would turn under its own edits.
        """
        if is_straightened and realpath(out) == realpath(self._folder):
            raise UserError(
                f"A straightened map has another frame than {self._folder}: name another folder for it."
            )
        if edits_beside(self._folder).text != self._saved.text:
            raise UserError(
                f"{self._folder / EDITS_FILE} was changed meanwhile and is left as it is: go back to the run "
                "and draw your edits over those that are there now."
            )
        if not self.is_saved(edits):
            save_edits(edits, self._folder)
            self._saved = edits
        check(self.place(out), [self._folder])
        rendering = {"turn": "walls" if is_straightened else 0.0, "crop": "driven" if is_cropped else None}
        config = self._config.model_copy(
            update={"rendering": self._config.rendering.model_copy(update=rendering)}
        )
        run = render_run(self._folder, config, RunContext(Report("racecar render")))
        run.save(out, replace=True)
        return self._told(edits, out, run)

    def _told(self, edits: MapEdits, out: Path, run: MapRun) -> str:
        width, height = run.result.tiled.metres
        count = len(edits.entries)
        words = [
            f"{count} edit{'s' if count != 1 else ''} in {self._folder / EDITS_FILE}."
            if edits.text
            else "There are no edits.",
            f"A map of {width:.0f} × {height:.0f} m was rendered into {out}: {', '.join(written_to(out))}.",
        ]
        return " ".join([*words, *run.warnings])


def as_the_map_lies(run: Path, config: MappingConfig) -> MappingConfig:
    """Settings that render the map of a run in its existing frame and with its cell size."""
    rendering = config.rendering.model_copy(update={"turn": 0.0, "crop": None, "origin": None})
    is_there = (run / "map.yaml").is_file()
    resolution = load_map(run).resolution if is_there else config.resolution
    return config.model_copy(update={"rendering": rendering, "resolution": resolution})
