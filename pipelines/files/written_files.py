"""Which files of a folder are still as racecar wrote them: its report.json holds the digest of each.

A map that was changed in an image editor, or a mask that was drawn there, is a user's work. Where it is
replaced, it is kept beside the new file: ``map.pgm`` as ``map.kept.pgm``.
"""

import hashlib
import json
import shutil
from collections.abc import Collection
from filecmp import cmp
from itertools import chain, count
from pathlib import Path
from typing import Any

from racecar.maps.whole_folders import is_removal, moves
from racecar.pipelines.files.authorship import author_of
from racecar.pipelines.files.report import write_json
from racecar.pipelines.files.run_report import REPORT_FILE, read_report

_PIECE = 1 << 20
"""Bytes read at once."""


def not_as_written(folder: Path, names: Collection[str]) -> list[Path]:
    """The files of these names in a folder that another program wrote or changed; for the name of a folder
    with a report of its own, those in it.

    Where no report holds digests, as of earlier versions, all are ours if one of them says so.
    """
    there = [path for name in sorted(names) if (path := folder / name).exists()]
    files, digests = [path for path in there if path.is_file()], read_report(folder).files
    if digests:
        known = (path for path in files if path.name != REPORT_FILE)
        found = [path for path in known if digests.get(path.name) != _digest(path)]
    else:
        found = [] if any(author_of(path) for path in files) else files
    for below in (path for path in there if path.is_dir()):
        found += not_as_written(below, read_report(below).files)
    return found


def keep_changed(folder: Path, new: Path) -> None:
    """Add to a ``new`` run copies of the files in the folder that it would replace or remove although another
    program wrote or changed them. Raises OSError."""
    sources = {target: source for source, target in moves(new, folder)}
    names = {target.relative_to(folder).parts[0] for target in sources}
    for path in not_as_written(folder, names):
        source = sources.get(path)
        if source is not None and not cmp(source, path, shallow=False):
            shutil.copy2(path, new / _free_name(path).relative_to(folder))


def record_written(folder: Path, new: Path) -> None:
    """Record the digests of a ``new`` run's files in its report, or else in that of the folder, to which it
    adds files. Nothing is recorded where there is neither. Raises OSError."""
    report = _report_in(new) or _report_in(folder)
    if report is None:
        return
    earlier = read_report(folder).files or ({} if _report_in(folder) is None else _digests(folder))
    removed = {target.name for source, target in moves(new, folder) if is_removal(source)}
    digests = {name: digest for name, digest in earlier.items() if name not in removed} | _digests(new)
    write_json(new / REPORT_FILE, {**report, "files": dict(sorted(digests.items()))})


def _report_in(folder: Path) -> dict[str, Any] | None:
    """The contents of a report of ours."""
    path = folder / REPORT_FILE
    try:
        return None if author_of(path) is None else dict(json.loads(path.read_bytes()))
    except (OSError, ValueError, RecursionError):
        return None


def _digests(folder: Path) -> dict[str, str]:
    """The digests of the files in a folder by name; a report cannot hold its own."""
    paths = (path for path in folder.iterdir() if path.is_file() and not is_removal(path))
    return {path.name: _digest(path) for path in paths if path.name != REPORT_FILE}


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()


def _free_name(path: Path) -> Path:
    """Such as map.kept.pgm, or map.kept-2.pgm if that exists."""
    numbers = chain([""], (f"-{number}" for number in count(2)))
    names = (f"{path.stem}.kept{number}{path.suffix}" for number in numbers)
    return next(kept for name in names if not (kept := path.with_name(name)).exists())
