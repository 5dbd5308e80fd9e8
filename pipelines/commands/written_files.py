"""What a command says at its end of the files that it wrote."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path, PurePath

from racecar.pipelines.files.outputs import written_to

_MOST_NAMES = 12
"""Above these, files are counted by kind, so that they fit on a line or two."""


def where_to_look(folder: Path, first: str, figures: Path | None = None) -> str:
    """A sentence that names the file to open first, what else was written to the folder, and the ``figures``
    of --json."""
    written = written_to(folder)
    others = [name for name in written if name != first]
    if written and first not in written:  # for want of a package
        where = f"Written to {folder}: {_listed(others)}."
    else:
        where = f"Look at {folder / first}" + (f"; also in {folder}: {_listed(others)}." if others else ".")
    return where + (f" {where_figures_are(figures)}" if figures else "")


def where_figures_are(path: Path) -> str:
    """A sentence that names the file of --json."""
    return f"The figures are in {path}."


def _listed(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    kinds = Counter(PurePath(name).suffix for name in names)
    counted = [f"{count} {kind} files" for kind, count in kinds.items() if kind and count > 1]
    return ", ".join([*counted, *(name for name in names if kinds[PurePath(name).suffix] == 1)])
