"""``edits.yaml`` beside a map: a list of edits, in metres and in the map's frame.

.. code-block:: yaml

    - erase: [[1.0, 2.0], [3.0, 2.0], [3.0, 4.0]]
    - wall: [[0, 0], [5, 0]]
      width: 0.1
    - speed: [[5, 0], [9, 0], [9, 3]]
      limit: 0.5
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.edits import EDIT_KINDS, Edit, EditKind
from racecar.maps.text_files import read_text
from racecar.maps.whole_files import write_atomically
from racecar.maps.whole_folders import finish_replacing
from racecar.maps.yaml_text import MOST_BYTES, UnreadableYamlError, parse_yaml
from racecar.pipelines.files.edits_text import with_entry, without_entry

EDITS_FILE = "edits.yaml"

_FARTHEST = 1e7
"""Metres; a quarter of the earth's circumference."""
_MOST_LIMIT = 100.0
"""Metres per second; no small robot is faster."""
_WIDEST = 100.0
"""Metres; a wider wall has the wrong unit."""
_DIGITS = 4
"""Decimals of metres in a written file: a tenth of a millimetre, finer than any cell."""


@dataclass(frozen=True, eq=False)
class MapEdits:
    """Edits, and the text they were read from."""

    edits: tuple[Edit, ...] = ()
    text: str = ""

    def moved(self, new_from_map: Pose | None) -> "MapEdits":
        """A copy in another frame; None keeps it as it is, with its comments."""
        if new_from_map is None or not self.edits:
            return self
        edits = tuple(edit.moved(new_from_map) for edit in self.edits)
        return MapEdits(edits, _as_moved_text(edits))

    def with_edit(self, edit: Edit) -> "MapEdits":
        """A copy with one more edit, drawn on top; comments stay. Raises UserError when it is invalid."""
        entry = _as_text([edit])
        edits = (*self.edits, _edit(parse_yaml(entry)[0], "What was drawn"))
        return MapEdits(edits, _changed_or_new(lambda: with_entry(self._own_text, entry), edits))

    def without(self, number: int) -> "MapEdits":
        """A copy without the edit with this number, from 0; comments on others stay."""
        edits = self.edits[:number] + self.edits[number + 1 :]
        return MapEdits(edits, _changed_or_new(lambda: without_entry(self._own_text, number), edits))

    @property
    def _own_text(self) -> str:
        """The text without the line that says it was moved here: whoever changes it makes it their own."""
        return self.text.partition("\n")[2] if is_made_by_us(self.text) else self.text


def load_edits(path: Path) -> MapEdits:
    """Load edits from a file. Raises UserError that explains the first mistake."""
    text = read_text(path, MOST_BYTES)
    try:
        entries = parse_yaml(text)
    except UnreadableYamlError as error:
        raise UserError(f"The edits in {path} cannot be used: {error}.") from error
    if not isinstance(entries, list | None):
        raise UserError(f"{path} should hold a list of edits, such as '- erase: [[0, 0], [1, 0], [1, 1]]'.")
    edits = tuple(_edit(entry, f"Edit {n} in {path}") for n, entry in enumerate(entries or [], start=1))
    return MapEdits(edits, text)


def edits_beside(folder: Path) -> MapEdits:
    """Edits of the map in a folder; none if there is no file."""
    finish_replacing(folder)
    path = folder / EDITS_FILE
    return load_edits(path) if path.is_file() else MapEdits()


def edits_together(parts: Sequence[MapEdits]) -> MapEdits:
    """Edits of several maps in the same frame; those of a single map keep their comments."""
    edited = [part for part in parts if part.edits]
    if len(edited) == 1:
        return edited[0]
    edits = tuple(edit for part in edited for edit in part.edits)
    return MapEdits(edits, _as_moved_text(edits)) if edits else MapEdits()


def save_edits(edits: MapEdits, folder: Path) -> None:
    """Write the edits of the map in a folder. Raises UserError when it cannot be written to."""
    with write_atomically(folder / EDITS_FILE) as partial:
        partial.write_text(edits.text, encoding="utf-8")


def is_made_by_us(text: str) -> bool:
    """Whether a file is as this program wrote it for another frame, so no user's work is lost."""
    head, _, body = text.partition("\n")
    return head == _head(body)


def _head(body: str) -> str:
    return f"# Moved into this map's frame, {zlib.crc32(body.encode()):08x}; make changes where it came from."


def _edit(entry: Any, where: str) -> Edit:
    known = ", ".join(EDIT_KINDS)
    if not isinstance(entry, dict):
        raise UserError(f"{where} should name what it does and where, such as 'wall: [[0, 0], [5, 0]]'.")
    kinds: list[EditKind] = [kind for kind in EDIT_KINDS if kind in entry]
    allowed = [*EDIT_KINDS, *(["width"] if "wall" in kinds else ["limit"] if "speed" in kinds else [])]
    for key in entry:
        if key not in allowed:
            near = get_close_matches(str(key), allowed, n=1)
            remedy = f"did you mean '{near[0]}'" if near else f"known are {known}"
            raise UserError(f"{where} has the unknown key '{str(key)[:40]}'; {remedy}.")
    if len(kinds) != 1:
        raise UserError(f"{where} should have one of {known}, and has {' and '.join(kinds) or 'none'}.")
    (kind,) = kinds
    points = _points(entry[kind], kind, where)
    if kind == "wall":
        return Edit(kind, points, width=_number(entry, "width", 0.0, _WIDEST, "metres", where, 0.0))
    if kind == "speed":
        return Edit(kind, points, limit=_number(entry, "limit", 0.0, _MOST_LIMIT, "metres per second", where))
    return Edit(kind, points)


def _points(value: Any, kind: EditKind, where: str) -> NDArray[np.float64]:
    fewest = 2 if kind == "wall" else 3
    if not isinstance(value, list) or not all(_is_point(point) for point in value):
        raise UserError(
            f"{where}: {kind} should be a list of points in metres, such as [[0, 0], [5, 0], [5, 2]]."
        )
    if len(value) < fewest:
        raise UserError(f"{where}: {kind} has {len(value)} points and needs {fewest} at least.")
    points = np.array(value, dtype=np.float64)
    if kind != "wall":
        _check_polygon(points, kind, where)
    elif not np.ptp(points, axis=0).any():
        raise UserError(f"{where}: all points of the wall are the same.")
    return points


def _is_point(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
        and all(isfinite(x) and abs(x) <= _FARTHEST for x in value)
    )


def _check_polygon(points: NDArray[np.float64], kind: EditKind, where: str) -> None:
    """Raises UserError unless the interior is well defined."""
    from shapely import Polygon
    from shapely.validation import explain_validity

    polygon = Polygon(points)
    if polygon.is_valid and polygon.area > 0.0:
        return
    if polygon.convex_hull.area == 0.0:
        raise UserError(f"{where}: the outline of {kind} has no area; name three corners that differ.")
    reason, _, place = explain_validity(polygon).rstrip("]").partition("[")
    if place and "Self-intersection" in reason:
        x, y = (float(number) for number in place.split()[:2])
        raise UserError(
            f"{where}: the outline of {kind} crosses itself near ({x:.2f}, {y:.2f}); sort its corners."
        )
    raise UserError(f"{where}: the outline of {kind} is not a polygon ({reason.lower()}); sort its corners.")


def _number(
    entry: dict[Any, Any],
    key: str,
    low: float,
    high: float,
    unit: str,
    where: str,
    default: float | None = None,
) -> float:
    if key not in entry and default is not None:
        return default
    value = entry.get(key)
    number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else low
    if not low < number <= high:
        told = "is missing" if value is None else f"is {str(value)[:40]}"
        raise UserError(f"{where}: {key} {told}; it should be {unit}, above {low:g} and at most {high:g}.")
    return number


def _changed_or_new(change: Callable[[], str], edits: Sequence[Edit]) -> str:
    """The changed text; a new one without comments if the old one's form does not allow the change."""
    try:
        return change()
    except ValueError:
        return _as_text(edits)


def _as_moved_text(edits: Sequence[Edit]) -> str:
    body = _as_text(edits)
    return f"{_head(body)}\n{body}"


def _as_text(edits: Sequence[Edit]) -> str:
    """One line per edit, and one for its width or limit."""
    lines = []
    for edit in edits:
        lines.append(f"- {edit.kind}: {np.round(edit.points, _DIGITS).tolist()}\n")
        numbers = {"width": edit.width, "limit": edit.limit}
        lines += [f"  {yaml.safe_dump({key: number})}" for key, number in numbers.items() if number]
    return "".join(lines)
