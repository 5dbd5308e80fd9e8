"""``edits.yaml`` beside a map: a list of edits, in metres and in the map's frame.

.. code-block:: yaml

    - erase: [[1.0, 2.0], [3.0, 2.0], [3.0, 4.0]]
    - wall: [[0, 0], [5, 0]]
      width: 0.1
    - speed: [[5, 0], [9, 0], [9, 3]]
      limit: 0.5

Entries that are not drawn but added to its pose graph are in `racecar.pipelines.files.constraint_entries`.
"""

import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import yaml
from numpy.typing import NDArray

from racecar.mapping.mending.manual_constraints import (
    ManualConstraint,
    in_recordings_from,
    moved,
    with_points,
)
from racecar.mapping.mending.manual_constraints import points_of as points_in
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.edits import EDIT_KINDS, Edit, EditKind
from racecar.maps.text_files import read_text
from racecar.maps.whole_files import write_atomically
from racecar.maps.whole_folders import finish_replacing
from racecar.maps.yaml_text import MOST_BYTES, UnreadableYamlError, parse_yaml
from racecar.pipelines.files.constraint_entries import CONSTRAINT_KINDS, constraint_of, text_of_constraint
from racecar.pipelines.files.edits_text import with_entry, without_entry
from racecar.pipelines.files.entry_values import check_keys, number_of, points_of

EDITS_FILE = "edits.yaml"

_MOST_LIMIT = 100.0
"""Metres per second; no small robot is faster."""
_WIDEST = 100.0
"""Metres; a wider wall has the wrong unit."""
_DIGITS = 4
"""Decimals of metres in a written file: a tenth of a millimetre, finer than any cell."""


Entry: TypeAlias = Edit | ManualConstraint
"""What is drawn over the map, or added to its pose graph."""


@dataclass(frozen=True, eq=False)
class MapEdits:
    """The entries, and the text they were read from."""

    entries: tuple[Entry, ...] = ()
    text: str = ""

    @property
    def edits(self) -> tuple[Edit, ...]:
        """What is drawn over the map."""
        return tuple(entry for entry in self.entries if isinstance(entry, Edit))

    @property
    def constraints(self) -> tuple[ManualConstraint, ...]:
        """What is added to its pose graph."""
        return tuple(entry for entry in self.entries if not isinstance(entry, Edit))

    @property
    def constraints_text(self) -> str:
        """The manual constraints alone, exactly: what a session was corrected by."""
        return "".join(text_of_constraint(each) for each in self.constraints)

    def moved(self, new_from_map: Pose | None) -> "MapEdits":
        """A copy in another frame; None keeps it as it is, with its comments."""
        if new_from_map is None or not self.entries:
            return self
        return self._made_of(
            _as_written(entry.moved(new_from_map)) if isinstance(entry, Edit) else moved(entry, new_from_map)
            for entry in self.entries
        )

    def carried(self, carry: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> "MapEdits":
        """A copy on a map that was bent: ``carry`` takes places (N, 2) from the old map to the new one."""
        if not any(isinstance(entry, Edit) or points_in(entry) is not None for entry in self.entries):
            return self
        entries = tuple(_carried(entry, carry) for entry in self.entries)
        return MapEdits(entries, _as_text(entries))

    def in_recordings_from(self, first: int) -> "MapEdits":
        """A copy where the recordings of its map are numbered from ``first`` on, as in a merged one."""
        if not self.constraints:
            return self
        return self._made_of(
            entry if isinstance(entry, Edit) else in_recordings_from(entry, first) for entry in self.entries
        )

    def with_entry(self, entry: Entry) -> "MapEdits":
        """A copy with one more entry, drawn on top; comments stay. Raises UserError when it is invalid."""
        text = _as_text([entry])
        entries = (*self.entries, _entry(parse_yaml(text)[0], "What was drawn"))
        return MapEdits(entries, _changed_or_new(lambda: with_entry(self._own_text, text), entries))

    def without(self, entry: Entry) -> "MapEdits":
        """A copy without one of its entries; comments on others stay."""
        number = next(k for k, each in enumerate(self.entries) if each is entry)
        entries = self.entries[:number] + self.entries[number + 1 :]
        return MapEdits(entries, _changed_or_new(lambda: without_entry(self._own_text, number), entries))

    @property
    def _own_text(self) -> str:
        """The text without the line that says it was moved here: whoever changes it makes it their own."""
        return self.text.partition("\n")[2] if is_made_by_us(self.text) else self.text

    def _made_of(self, entries: Iterable[Entry]) -> "MapEdits":
        known = tuple(entries)
        return MapEdits(known, _as_moved_text(known))


def load_edits(path: Path) -> MapEdits:
    """Load edits from a file. Raises UserError that explains the first mistake."""
    text = read_text(path, MOST_BYTES)
    try:
        entries = parse_yaml(text)
    except UnreadableYamlError as error:
        raise UserError(f"The edits in {path} cannot be used: {error}.") from error
    if not isinstance(entries, list | None):
        raise UserError(f"{path} should hold a list of edits, such as '- erase: [[0, 0], [1, 0], [1, 1]]'.")
    known = tuple(_entry(entry, f"Edit {n} in {path}") for n, entry in enumerate(entries or [], start=1))
    return MapEdits(known, text)


def edits_beside(folder: Path) -> MapEdits:
    """Edits of the map in a folder; none if there is no file."""
    finish_replacing(folder)
    path = folder / EDITS_FILE
    return load_edits(path) if path.is_file() else MapEdits()


def edits_together(parts: Sequence[MapEdits]) -> MapEdits:
    """Edits of several maps in the same frame; those of a single map keep their comments."""
    edited = [part for part in parts if part.entries]
    if len(edited) == 1:
        return edited[0]
    entries = tuple(entry for part in edited for entry in part.entries)
    return MapEdits(entries, _as_moved_text(entries)) if entries else MapEdits()


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


def _entry(entry: Any, where: str) -> Entry:
    kinds = (*EDIT_KINDS, *CONSTRAINT_KINDS)
    known = ", ".join(kinds)
    if not isinstance(entry, dict):
        raise UserError(f"{where} should name what it does and where, such as 'wall: [[0, 0], [5, 0]]'.")
    named = [kind for kind in kinds if kind in entry]
    if len(named) > 1:
        raise UserError(f"{where} should have one of {known}, and has {' and '.join(named)}.")
    if named and named[0] in CONSTRAINT_KINDS:
        return constraint_of(entry, named[0], where)
    kind = next((each for each in EDIT_KINDS if each in named), None)
    own = ["width"] if kind == "wall" else ["limit"] if kind == "speed" else []
    check_keys(entry, [*kinds, *own], known, where)
    if kind is None:
        raise UserError(f"{where} should have one of {known}, and has none.")
    points = _points(entry[kind], kind, where)
    if kind == "wall":
        return Edit(kind, points, width=number_of(entry, "width", 0.0, _WIDEST, "metres", where, 0.0))
    if kind == "speed":
        limit = number_of(entry, "limit", 0.0, _MOST_LIMIT, "metres per second", where)
        return Edit(kind, points, limit=limit)
    return Edit(kind, points)


def _points(value: Any, kind: EditKind, where: str) -> NDArray[np.float64]:
    fewest = 2 if kind == "wall" else 3
    points = points_of(value, kind, where)
    if len(points) < fewest:
        raise UserError(f"{where}: {kind} has {len(points)} points and needs {fewest} at least.")
    if kind != "wall":
        _check_polygon(points, kind, where)
    elif not np.ptp(points, axis=0).any():
        raise UserError(f"{where}: all points of the wall are the same.")
    return points


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


def _carried(entry: Entry, carry: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Entry:
    if isinstance(entry, Edit):
        return _as_written(replace(entry, points=carry(entry.points)))
    points = points_in(entry)
    return entry if points is None else with_points(entry, carry(points))


def _as_written(edit: Edit) -> Edit:
    """With the digits of the file, so that it is drawn the same when it was read again."""
    return replace(edit, points=np.round(edit.points, _DIGITS))


def _changed_or_new(change: Callable[[], str], entries: Sequence[Entry]) -> str:
    """The changed text; a new one without comments if the old one's form does not allow the change."""
    try:
        return change()
    except ValueError:
        return _as_text(entries)


def _as_moved_text(entries: Sequence[Entry]) -> str:
    body = _as_text(entries)
    return f"{_head(body)}\n{body}"


def _as_text(entries: Sequence[Entry]) -> str:
    """One line per entry, and one for each further value of it."""
    return "".join(
        _text_of_edit(entry) if isinstance(entry, Edit) else text_of_constraint(entry) for entry in entries
    )


def _text_of_edit(edit: Edit) -> str:
    numbers = {"width": edit.width, "limit": edit.limit}
    lines = [f"- {edit.kind}: {np.round(edit.points, _DIGITS).tolist()}\n"]
    lines += [f"  {yaml.safe_dump({key: number})}" for key, number in numbers.items() if number]
    return "".join(lines)
