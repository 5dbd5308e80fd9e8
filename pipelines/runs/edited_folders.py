"""Which edits a map is drawn with, so that none is lost and none lands in another frame."""

from os.path import realpath
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.pipelines.files.edits_file import EDITS_FILE, MapEdits, edits_beside, is_made_by_us
from racecar.pipelines.files.report import Report


def edits_of_new_map(out: Path, continued: Path | None, report: Report) -> MapEdits:
    """Those of the map that is carried on. A map of its own has none, since it may lie in another frame than
    the one that it replaces; the report warns of that.

    Raises UserError when those beside the map have a mistake, or would replace others.
    """
    if continued is not None:
        edits = edits_beside(continued)
        refuse_to_lose_edits(out, edits, continued)
        return edits
    if (out / EDITS_FILE).is_file():
        report.warn(
            f"{out / EDITS_FILE} was not applied, because a new map may lie in another frame; "
            f"if it fits, `racecar render {out} --out {out}` applies it."
        )
    return MapEdits()


def refuse_to_lose_edits(out: Path, edits: MapEdits, source: Path) -> None:
    """Raises UserError when a folder holds edits that somebody wrote, and others are to be written there."""
    path, home = out / EDITS_FILE, source if source.is_dir() else source.parent
    if not path.is_file() or realpath(out) == realpath(home):
        return
    there = read_text(path)
    if there != edits.text and not is_made_by_us(there):
        raise UserError(
            f"{path} holds other edits than those of {source}: move them there, or render {out} itself, "
            "or remove the file."
        )
